//! Diagnostics and transforms against known answers.
#![allow(clippy::unwrap_used)]
mod common;

use common::{gauss, rng};
use nalgebra::DMatrix;
use starlings_estimators::{
    Gaussian, Transform, autocorrelation, correlation, effective_sample_size, freedom_of_third_differences,
    n_third_difference, nis_band, nis_band_of_uncertain_noise, noise_from_third_differences,
};

fn white(seed: u64, n: usize) -> Vec<f64> {
    let mut g = rng(seed);
    (0..n).map(|_| gauss(&mut g)).collect()
}

#[test]
fn third_differences_find_the_noise_under_a_smooth_signal_with_holes() {
    let mut series: Vec<f64> =
        white(80, 4000).iter().enumerate().map(|(k, e)| 0.3 * e + 50.0 * (k as f64 * 0.01).sin()).collect();
    series[100] = f64::NAN;
    series[2000] = 1e6;
    // The median of 4000 correlated differences has a sd of about 3 %.
    assert!((noise_from_third_differences(&series) / 0.3 - 1.0).abs() < 0.08);
    assert!(noise_from_third_differences(&[1.0, 2.0, 3.0]).is_nan());
    let parabola: Vec<f64> = (0..20).map(|k| f64::from(k * k)).collect();
    assert!(noise_from_third_differences(&parabola) < 1e-12);
}

#[test]
fn third_differences_tell_the_noise_as_well_as_their_freedom_says() {
    // Stretches of seven have four differences each, which tell a little more than as many of one long stretch.
    for (n, gap, [lo, hi]) in
        [(60, None, [0.75, 1.25]), (250, None, [0.75, 1.25]), (400, Some(8), [0.5, 1.1])]
    {
        let series = |k: u64| -> Vec<f64> {
            let is_gap = |i: usize| gap.is_some_and(|gap| i % gap == gap - 1);
            let values = white(1000 + k, n).into_iter().enumerate();
            values.map(|(i, v)| if is_gap(i) { f64::NAN } else { v }).collect()
        };
        let logs: Vec<f64> =
            (0..400).map(|k| noise_from_third_differences(&series(k)).powi(2).ln()).collect();
        let freedom = freedom_of_third_differences(n_third_difference(&series(0)));
        let mean = logs.iter().sum::<f64>() / 400.0;
        let variance = logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / 399.0;
        // A variance of 400 values scatters by 7 %; of a logarithm it is 2/freedom up to a few per cent.
        let ratio = 0.5 * variance * freedom;
        assert!((lo..hi).contains(&ratio), "{n} with gaps {gap:?}: {ratio}");
    }
}

#[test]
fn the_band_of_squares_over_an_uncertain_noise_is_that_of_their_ratio() {
    // Tables of F: 2.774 with 10 and 20 degrees of freedom, 3.419 with 20 and 10, at 0.975.
    let (lo, hi) = nis_band_of_uncertain_noise(10, 20.0, 0.95);
    assert!((hi - 2.774).abs() < 5e-4 && (1.0 / lo - 3.419).abs() < 5e-4, "{lo} {hi}");
    assert_eq!(nis_band_of_uncertain_noise(10, f64::INFINITY, 0.95), nis_band(10, 0.95));
}

#[test]
fn autocorrelation_of_a_known_series() {
    // Deviations -1.5 -0.5 0.5 1.5: products 5, 1.25, -1.5, -2.25... over 5.
    let rho = autocorrelation(&[1.0, 2.0, 3.0, 4.0], 4);
    for (found, expected) in rho.iter().zip([1.0, 0.25, -0.3, -0.45, 0.0]) {
        assert!((found - expected).abs() < 1e-15);
    }
    assert_eq!(rho.len(), 5);
    assert!(autocorrelation(&[2.0; 5], 1).iter().all(|v| v.is_nan()));
    let holed = autocorrelation(&[1.0, f64::NAN, 3.0], 2);
    assert!((holed[2] + 0.5).abs() < 1e-15 && holed[1].abs() < 1e-15);
}

#[test]
fn effective_sample_size_of_white_and_of_autoregressive_noise() {
    let e = white(81, 20_000);
    // White: n. First order with coefficient 0.9: n (1 - 0.9) / (1 + 0.9), estimated to about 10 %.
    assert!(effective_sample_size(&e) > 0.9 * 20_000.0);
    let mut x = 0.0;
    let correlated: Vec<f64> = e
        .iter()
        .map(|e| {
            x = 0.9 * x + e;
            x
        })
        .collect();
    let expected = 20_000.0 * 0.1 / 1.9;
    assert!((effective_sample_size(&correlated) / expected - 1.0).abs() < 0.2);
    assert!(effective_sample_size(&[]).is_nan());
}

#[test]
fn the_effective_sample_size_of_a_million_values_takes_few_passes() {
    let e = white(82, 1_000_000);
    // White noise decides at the first pairs; all lags would be 5e11 products.
    assert!(effective_sample_size(&e) > 0.99e6);
    // The last lag of an odd series has no partner and does not count.
    assert!((effective_sample_size(&[1.0, 2.0, 3.0]) - 3.0).abs() < 1e-14);
}

#[test]
fn the_nis_band_has_tabulated_chi_square_quantiles() {
    // Chi-square tables, 2.5 and 97.5 %: 3.247 and 20.483 for ten degrees of freedom.
    let (lo, hi) = nis_band(10, 0.95);
    assert!((lo - 0.3247).abs() < 1e-4 && (hi - 2.0483).abs() < 1e-4);
    let (lo, hi) = nis_band(100_000, 0.95);
    // Wilson-Hilferty: 1 +- 1.96 sqrt(2/n).
    assert!((lo - 0.991_25).abs() < 1e-4 && (hi - 1.008_78).abs() < 1e-4, "{lo} {hi}");
    assert!(nis_band(0, 0.95).0.is_nan());
}

#[test]
fn correlations_are_covariances_over_sd() {
    let c = correlation(&DMatrix::from_row_slice(3, 3, &[4.0, 3.0, 0.0, 3.0, 9.0, 0.0, 0.0, 0.0, 0.0]));
    let expected = DMatrix::from_row_slice(3, 3, &[1.0, 0.5, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 1.0]);
    assert!((c - expected).amax() < 1e-15);
    assert!((Gaussian::independent(&[0.0], &[3.0]).sd()[0] - 3.0).abs() < 1e-15);
}

const TRANSFORMS: [Transform; 4] =
    [Transform::Log, Transform::Log2, Transform::Linear, Transform::Logit { lo: -1.0, hi: 5.0 }];

#[test]
fn transforms_return_and_have_their_derivative() {
    for transform in TRANSFORMS {
        for theta in [-3.0, -0.5, 0.0, 0.7, 4.0] {
            let v = transform.to_physical(theta);
            assert!(transform.contains(v));
            assert!((transform.to_transformed(v) - theta).abs() < 1e-12, "{transform:?}");
            let h = 1e-5;
            let slope = (transform.to_physical(theta + h) - transform.to_physical(theta - h)) / (2.0 * h);
            // Central differences: h^2 and rounding / h.
            assert!((transform.derivative(theta) - slope).abs() < 1e-7 * (1.0 + slope), "{transform:?}");
        }
    }
    assert_eq!(TRANSFORMS.map(|t| t.name()), Transform::NAMES);
}

#[test]
fn transforms_know_their_domain() {
    assert!(!Transform::Log.contains(0.0) && !Transform::Log2.contains(-1.0));
    assert!(!Transform::Linear.contains(f64::NAN));
    let bounded = TRANSFORMS[3];
    assert!(!bounded.contains(-1.0) && !bounded.contains(5.0) && bounded.contains(4.9));
    assert!((Transform::Log2.to_physical(3.0) - 8.0).abs() < 1e-14);
    assert!((bounded.to_physical(0.0) - 2.0).abs() < 1e-14);
    for bounded in
        [bounded, Transform::Logit { lo: 0.0, hi: 1.0 }, Transform::Logit { lo: 1e6, hi: 1e6 + 1.0 }]
    {
        for theta in [-800.0, -37.0, 37.0, 800.0, f64::NEG_INFINITY, f64::INFINITY] {
            let v = bounded.to_physical(theta);
            assert!(bounded.contains(v) && bounded.to_transformed(v).is_finite(), "{bounded:?} {theta}: {v}");
        }
        assert!(bounded.to_physical(f64::NAN).is_nan());
    }
}
