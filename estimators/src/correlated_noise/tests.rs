use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;

/// Times with unequal steps and a gap.
fn times(n: usize) -> Vec<f64> {
    (0..n).map(|i| 0.1 * i as f64 + 0.03 * (i % 3) as f64 + if i > n / 2 { 2.0 } else { 0.0 }).collect()
}

fn white(n: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| StandardNormal.sample(&mut random)).collect()
}

fn covariance(noise: &CorrelatedNoise, times: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(times.len(), times.len(), |i, j| {
        let of_both = noise.correlated * (-(times[i] - times[j]).abs() / noise.length).exp();
        of_both + if i == j { noise.white } else { 0.0 }
    })
}

#[test]
fn the_innovations_and_the_density_are_those_of_the_dense_covariance() {
    let times = times(60);
    for (white_part, correlated, length) in
        [(1.0, 0.5, 0.4), (0.05, 0.95, 0.15), (1.0, 40.0, 30.0), (1e-3, 1.0, 1.0)]
    {
        let noise = CorrelatedNoise { white: white_part, correlated, length };
        let values = white(60, 3);
        let root = covariance(&noise, &times).cholesky().unwrap();
        let wanted = root.l().solve_lower_triangular(&DVector::from_vec(values.clone())).unwrap();
        let mut found = values.clone();
        noise.whiten(&times, &mut found);
        // The condition of the last covariance is below 1e5, which leaves eleven digits.
        for (found, wanted) in found.iter().zip(wanted.iter()) {
            assert!((found - wanted).abs() < 1e-10 * wanted.abs().max(1.0), "{found} {wanted}");
        }
        let log_det = root.l().diagonal().iter().map(|d| 2.0 * d.ln()).sum::<f64>();
        let density = -0.5 * (wanted.norm_squared() + log_det + 60.0 * std::f64::consts::TAU.ln());
        assert!((noise.log_density(&times, &values) - density).abs() < 1e-10 * density.abs());
        noise.colour(&times, &mut found);
        for (found, wanted) in found.iter().zip(&values) {
            assert!((found - wanted).abs() < 1e-10, "colour is the inverse of whiten");
        }
    }
}

#[test]
fn without_a_correlated_part_values_keep_their_bits() {
    let noise = CorrelatedNoise { white: 1.0, correlated: 0.0, length: 0.3 };
    let values = white(50, 9);
    let mut found = values.clone();
    noise.whiten(&times(50), &mut found);
    assert!(found.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()));
}

fn drawn(noise: &CorrelatedNoise, n: usize, seed: u64) -> Series {
    let (times, mut values) = (times(n), white(n, seed));
    noise.colour(&times, &mut values);
    Series { times, values }
}

#[test]
fn the_noise_that_made_the_values_is_found_over_several_stretches() {
    let truth = CorrelatedNoise { white: 0.3, correlated: 0.7, length: 0.8 };
    let series: Vec<Series> = (0..8).map(|seed| drawn(&truth, 1000, seed)).collect();
    let found = fit_noise(&series, Part::OfTheNoise).unwrap();
    // 8000 values at an eighth of the length hold about 600 independent ones of the correlated part: its length is known to 8 %,
    // the parts to 3 %; three of these.
    assert!((found.noise.length / truth.length).ln().abs() < 0.25, "{found:?}");
    assert!((found.noise.correlated - truth.correlated).abs() < 0.1, "{found:?}");
    let of_truth: f64 = series.iter().map(|s| truth.log_density(&s.times, &s.values)).sum();
    assert!(found.log_density >= of_truth - 1e-3, "no density is above the largest");
    assert!((found.noise.white + found.noise.correlated - 1.0).abs() < 1e-12);
}

#[test]
fn the_families_tell_noise_with_a_memory_from_white_noise_with_something_on_top() {
    let n = 400;
    let of_the_noise = CorrelatedNoise { white: 0.02, correlated: 0.98, length: 0.2 };
    let on_top = CorrelatedNoise { white: 1.0, correlated: 1.5, length: 0.6 };
    for seed in 0..10 {
        let both = |noise: &CorrelatedNoise| {
            let series = [drawn(noise, n, seed)];
            [Part::OfTheNoise, Part::OnTop].map(|part| fit_noise(&series, part).unwrap().log_density)
        };
        let [inside, outside] = both(&of_the_noise);
        // The innovations of the former have a variance of about 0.6, which no white noise of one allows.
        assert!(inside - outside > 20.0, "seed {seed}: {inside} {outside}");
        let [inside, outside] = both(&on_top);
        assert!(outside - inside > 5.0, "seed {seed}: {inside} {outside}");
    }
}

#[test]
fn too_few_values_have_no_fit() {
    let series = |n: usize| Series { times: times(n), values: white(n, 1) };
    assert!(fit_noise(&[], Part::OnTop).is_none());
    assert!(fit_noise(&[series(1), series(2)], Part::OnTop).is_none());
    assert!(fit_noise(&[series(3)], Part::OnTop).is_some());
}
