//! The moments of every sigma set.
#![allow(clippy::unwrap_used)]
mod common;

use common::ALL;
use nalgebra::DMatrix;
use starlings_estimators::{EstimatorError, Points, SigmaSet};

#[test]
fn every_set_has_unit_weight_zero_mean_and_unit_covariance_for_1_to_14_parameters() {
    for p in 1..=14 {
        for points in ALL {
            let set = SigmaSet::new(points, p).unwrap();
            let mean = &set.points * &set.weights;
            let covariance = &set.points * DMatrix::from_diagonal(&set.weights) * set.points.transpose();
            // A few roundings of numbers of order sqrt(p).
            assert!((set.weights.sum() - 1.0).abs() < 1e-14, "{points:?} {p}");
            assert!(mean.amax() < 1e-14, "{points:?} {p}");
            assert!((covariance - DMatrix::identity(p, p)).amax() < 1e-14, "{points:?} {p}");
            assert!(set.weights.iter().all(|w| *w > 0.0));
        }
    }
}

#[test]
fn the_sets_have_their_number_of_particles() {
    let count = |points| SigmaSet::new(points, 5).unwrap().n_particle();
    assert_eq!(ALL.map(count), [6, 10, 11, 11]);
    assert_eq!(SigmaSet::new(Points::Simplex, 5).unwrap().n_param(), 5);
}

#[test]
fn kappa_one_half_is_the_star() {
    let star = SigmaSet::new(Points::Star, 3).unwrap();
    let half = SigmaSet::new(Points::JulierUhlmann { kappa: 0.5 }, 3).unwrap();
    assert!((star.points - half.points).amax() < 1e-15 && (star.weights - half.weights).amax() < 1e-15);
}

#[test]
fn kappa_three_minus_p_matches_the_fourth_moment_of_a_gaussian() {
    let set = SigmaSet::new(Points::JulierUhlmann { kappa: 2.0 }, 1).unwrap();
    let fourth: f64 = set.points.row(0).iter().zip(&set.weights).map(|(x, w)| w * x.powi(4)).sum();
    assert!((fourth - 3.0).abs() < 1e-14);
}

#[test]
fn no_parameters_and_a_centre_without_weight_are_refused() {
    assert_eq!(SigmaSet::new(Points::Simplex, 0), Err(EstimatorError::NoParameters));
    for kappa in [0.0, -1.0, f64::INFINITY] {
        let refused = SigmaSet::new(Points::JulierUhlmann { kappa }, 2);
        assert_eq!(refused, Err(EstimatorError::Kappa { kappa }));
    }
    assert!(SigmaSet::new(Points::JulierUhlmann { kappa: f64::NAN }, 2).is_err());
}
