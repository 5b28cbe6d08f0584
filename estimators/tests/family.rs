//! What every filter of the list must do.
#![allow(clippy::unwrap_used)]

mod common;

use common::{difference, normal, rng};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::{Data, Filter, Form, Gaussian, KINDS, Kind, Noise, Options, Points, Root};

/// The filters of the list, made for p parameters.
fn filters(n_param: usize) -> Vec<(&'static Kind, Box<dyn Filter>)> {
    let options = Options { n_param, points: Points::Simplex, root: Root::Symmetric, seed: 7 };
    let made = KINDS.iter().filter_map(|kind| match &kind.form {
        Form::Windows(make) => Some((*kind, make(&options).unwrap())),
        Form::WholeRecords(_) => None,
    });
    made.collect()
}

#[test]
fn every_name_is_given_once_and_every_spread_is_positive() {
    for (i, kind) in KINDS.iter().enumerate() {
        assert!(KINDS[..i].iter().all(|other| other.name != kind.name), "{} twice", kind.name);
        assert!(kind.spread > 0.0, "{}", kind.name);
    }
}

#[test]
fn every_filter_begins_with_the_prior() {
    let prior = Gaussian::independent(&[1.0, -2.0, 0.5], &[0.3, 2.0, 1.0]);
    for (kind, filter) in filters(3) {
        let particles = filter.init(&prior);
        assert_eq!(particles.theta.shape(), (3, filter.n_particle()), "{}", kind.name);
        assert!((filter.weights().sum() - 1.0).abs() < 1e-12, "{}", kind.name);
        let begun = filter.gaussian(&particles);
        assert!((begun.mean - &prior.mean).amax() < 1e-12, "{}", kind.name);
        assert!(difference(&begun.covariance, &prior.covariance) < 1e-12, "{}", kind.name);
    }
}

#[test]
fn every_filter_solves_the_linear_gaussian_problem_of_constant_parameters() {
    let (p, m, steps, sd) = (3, 2, 12, 0.7);
    let mut random = rng(5);
    let prior = Gaussian::independent(&[1.0, -2.0, 0.5], &[0.3, 2.0, 1.0]);
    let maps: Vec<DMatrix<f64>> = (0..steps).map(|_| normal(&mut random, m, p)).collect();
    let observed: Vec<Vec<f64>> = (0..steps).map(|_| normal(&mut random, m, 1).as_slice().to_vec()).collect();

    // The same in one step: precisions add up, and so do their products with the means.
    let mut precision = prior.covariance.clone().try_inverse().unwrap();
    let mut weighted = &precision * &prior.mean;
    for (h, y) in maps.iter().zip(&observed) {
        precision += h.transpose() * h / (sd * sd);
        weighted += h.transpose() * DVector::from_column_slice(y) / (sd * sd);
    }
    let covariance = precision.try_inverse().unwrap();
    let mean = &covariance * weighted;

    let noise = Noise::Diagonal(vec![sd; m]);
    for (kind, filter) in filters(p) {
        let mut particles = filter.init(&prior);
        for (h, values) in maps.iter().zip(&observed) {
            let predictions = h * &particles.theta;
            particles = filter.analysis(&particles, &predictions, &Data { values, noise: &noise }).unwrap().0;
        }
        let found = filter.gaussian(&particles);
        assert!((&found.mean - &mean).amax() < 1e-10, "{}: {} against {mean}", kind.name, found.mean);
        assert!(difference(&found.covariance, &covariance) < 1e-10, "{}", kind.name);
    }
}
