//! Exchanging the prior is exact on a linear Gaussian problem.
#![allow(clippy::unwrap_used)]
mod common;

use common::{difference, filter, gauss, normal, rng};
use nalgebra::DMatrix;
use starlings_estimators::{
    Data, EstimatorError, Exchanged, Filter, Gaussian, Noise, Points, Root, exchange_prior,
};

/// Posterior, log-likelihood and NIS of 50 linear observations filtered one by one.
fn filtered(prior: &Gaussian, n_seen: usize) -> (Gaussian, f64, f64) {
    let mut g = rng(50);
    let roukf = filter(Points::Simplex, 4, Root::Symmetric);
    let mut particles = roukf.init(prior);
    let truth = normal(&mut g, 4, 1);
    let noise = Noise::Diagonal(vec![0.3]);
    let (mut log_likelihood, mut nis) = (0.0, 0.0);
    for _ in 0..50 {
        let mut h = normal(&mut g, 1, 4);
        h.columns_mut(n_seen, 4 - n_seen).fill(0.0);
        let y = (&h * &truth)[0] + 0.3 * gauss(&mut g);
        let data = Data { values: &[y], noise: &noise };
        let (next, a) = roukf.analysis(&particles, &(&h * &particles.theta), &data).unwrap();
        particles = next;
        log_likelihood += a.log_likelihood;
        nis += a.nis;
    }
    (roukf.gaussian(&particles), log_likelihood, nis)
}

fn wanted() -> Gaussian {
    let mut g = rng(51);
    let root = normal(&mut g, 4, 4);
    Gaussian { mean: normal(&mut g, 4, 1).column(0).clone_owned(), covariance: &root * root.transpose() }
}

#[test]
fn a_filter_from_a_hundred_times_narrower_prior_elsewhere_becomes_the_direct_filter() {
    let wanted = wanted();
    let (direct, log_likelihood, nis) = filtered(&wanted, 4);
    let used = Gaussian {
        mean: &wanted.mean + nalgebra::DVector::from_column_slice(&[0.3, -0.2, 0.5, 0.1]),
        covariance: &wanted.covariance / 1e4,
    };
    let (narrow, other, other_nis) = filtered(&used, 4);
    let Exchanged { posterior: exchanged, log_likelihood: correction, nis: nis_correction } =
        exchange_prior(&narrow, &used, &wanted).unwrap();
    // The narrow prior holds most of the narrow posterior's information, whose removal costs four digits.
    assert!((&exchanged.mean - &direct.mean).amax() < 1e-9, "{} {}", exchanged.mean, direct.mean);
    assert!(difference(&exchanged.covariance, &direct.covariance) < 1e-10);
    // Far from the data the narrow prior is very unlikely, by thousands in the log, all of which is corrected.
    assert!((other - log_likelihood).abs() > 10.0);
    assert!((other + correction - log_likelihood).abs() < 1e-7 * other.abs());
    assert!(
        (other_nis + nis_correction - nis).abs() < 1e-7 * other_nis,
        "{other_nis} {nis_correction} {nis}"
    );
}

#[test]
fn directions_without_information_return_to_the_wanted_prior() {
    let wanted = Gaussian::independent(&[0.0, 1.0, 2.0, 3.0], &[1.0, 2.0, 3.0, 4.0]);
    let used = Gaussian::independent(&[0.5; 4], &[0.1; 4]);
    let (direct, log_likelihood, _) = filtered(&wanted, 2);
    let (narrow, other, _) = filtered(&used, 2);
    let Exchanged { posterior: exchanged, log_likelihood: correction, .. } =
        exchange_prior(&narrow, &used, &wanted).unwrap();
    assert!((&exchanged.mean - &direct.mean).amax() < 1e-9, "{} {}", exchanged.mean, direct.mean);
    assert!(difference(&exchanged.covariance, &direct.covariance) < 1e-9);
    assert!((other + correction - log_likelihood).abs() < 1e-7 * other.abs());
}

#[test]
fn a_posterior_wider_than_its_prior_holds_no_information() {
    let used = Gaussian::independent(&[1.0], &[0.5]);
    let wide = Gaussian::independent(&[4.0], &[0.6]);
    let wanted = Gaussian::independent(&[-1.0], &[2.0]);
    let Exchanged { posterior: exchanged, log_likelihood: correction, .. } =
        exchange_prior(&wide, &used, &wanted).unwrap();
    assert!((exchanged.mean[0] + 1.0).abs() < 1e-14 && (exchanged.covariance[0] - 4.0).abs() < 1e-14);
    assert!(correction.abs() < 1e-14, "a few roundings");
}

#[test]
fn information_of_rounding_size_does_not_carry_a_moved_mean_away() {
    // A strongly and an unseen direction; the unseen one is sharper by rounding, and its mean moved by a tenth of a sd.
    let used = Gaussian::independent(&[0.0, 0.0], &[1e-3, 1e-3]);
    let wanted = Gaussian::independent(&[0.0, 0.0], &[1.0, 1.0]);
    for rounding in [0.0, 1e-15, 1e-12, 2e-10] {
        let posterior = Gaussian::independent(&[0.0, 1e-4], &[5e-4, 1e-3 * (1.0 - rounding)]);
        let exchanged = exchange_prior(&posterior, &used, &wanted).unwrap().posterior;
        assert!(exchanged.mean[1].abs() < 1e-12, "{rounding}: {}", exchanged.mean[1]);
        assert!((exchanged.covariance[(1, 1)] - 1.0).abs() < 1e-12, "{rounding}");
    }
}

#[test]
fn a_direction_that_the_data_know_a_hundredth_of_still_counts_under_a_narrow_prior() {
    // Information 0.01 under the wanted prior, 1e-8 under the used one; the datum says 3.
    let (e, datum) = (0.01, 3.0);
    let used = Gaussian::independent(&[0.0], &[1e-3]);
    let wanted = Gaussian::independent(&[0.0], &[1.0]);
    let precision = 1e6 + e;
    let posterior = Gaussian::independent(&[e * datum / precision], &[precision.sqrt().recip()]);
    let exchanged = exchange_prior(&posterior, &used, &wanted).unwrap().posterior;
    // One part in 1e8 of a number with 16 digits is left: 8 digits at best, fewer after the square roots.
    assert!((exchanged.mean[0] - e * datum / (1.0 + e)).abs() < 1e-6, "{}", exchanged.mean[0]);
    assert!((exchanged.covariance[0] - 1.0 / (1.0 + e)).abs() < 1e-6);
}

#[test]
fn a_corrected_nis_is_never_negative() {
    let used = Gaussian::independent(&[0.0], &[1e-3]);
    let wanted = Gaussian::independent(&[0.0], &[1.0]);
    let (narrow, datum) = (1e6, 5.0);
    // One datum of unit noise: all of its 25 under the used prior, half under the wanted one.
    let posterior = Gaussian::independent(&[datum / (narrow + 1.0)], &[(narrow + 1.0f64).sqrt().recip()]);
    let exchanged = exchange_prior(&posterior, &used, &wanted).unwrap();
    let nis = datum * datum / (1.0 + 1.0 / narrow);
    assert!((exchanged.corrected_nis(nis) - 12.5).abs() < 1e-6, "{}", exchanged.corrected_nis(nis));
    assert!(exchanged.corrected_nis(1.0) >= 0.0 && exchanged.nis < -1.0);
}

#[test]
fn the_same_prior_changes_nothing_and_a_singular_one_is_refused() {
    let prior = wanted();
    let (posterior, _, _) = filtered(&prior, 4);
    let Exchanged { posterior: same, log_likelihood: correction, .. } =
        exchange_prior(&posterior, &prior, &prior).unwrap();
    assert!((&same.mean - &posterior.mean).amax() < 1e-12 && correction.abs() < 1e-9);
    assert!(difference(&same.covariance, &posterior.covariance) < 1e-12);
    let flat = Gaussian { mean: prior.mean.clone(), covariance: DMatrix::zeros(4, 4) };
    let refused = exchange_prior(&posterior, &flat, &prior).unwrap_err();
    assert_eq!(refused, EstimatorError::NotPositiveDefinite { what: "used prior" });
    let short = Gaussian::independent(&[0.0], &[1.0]);
    assert!(matches!(exchange_prior(&posterior, &prior, &short), Err(EstimatorError::Shape { .. })));
}
