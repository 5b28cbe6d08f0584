//! The steps of the batch fit: runs that fail, damping, what is refused, and going on from a stored state.
#![allow(clippy::unwrap_used)]
mod common;

use common::batch::{compartments, ensemble, fit};
use common::rcr::{MM_HG, pressure, prior, truth};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::{Batch, BatchState, Data, EstimatorError, Gaussian, Noise, Points, SigmaSet};

#[test]
fn failed_centres_are_rejected_steps_and_failed_points_are_left_out() {
    // Nothing runs beyond a wall close to the answer, nor in a thin strip on the way.
    let model = |theta: &[f64]| {
        let y = compartments(theta);
        if theta[1] > 1.45 || (theta[0] > 1.55 && theta[0] < 1.57) { vec![f64::NAN; 30] } else { y }
    };
    let mean: Vec<f64> = [4.0f64, 1.5, 2.0, 0.15].iter().map(|v| v.ln()).collect();
    let prior = Gaussian::independent(&mean, &[1.1; 4]);
    let truth = [1.8, 1.25, 0.2, -2.5];
    let values = compartments(&truth);
    let noise = Noise::Diagonal(vec![0.05; 30]);
    let data = Data { values: &values, noise: &noise };
    let (_, step) = fit(Points::Simplex, &model, &prior, &data);
    assert!(step.converged);
    let off = (step.posterior.mean - DVector::from_column_slice(&truth))
        .component_div(&step.posterior.covariance.diagonal().map(f64::sqrt));
    assert!(off.amax() < 0.1, "noise-free data: {off}");
}

#[test]
fn a_start_that_cannot_be_run_is_an_error_and_bad_shapes_are_refused() {
    let prior = Gaussian::independent(&[0.0, 0.0], &[1.0, 1.0]);
    let batch = Batch::new(SigmaSet::new(Points::Simplex, 2).unwrap());
    let state = batch.init(&prior);
    let noise = Noise::Diagonal(vec![1.0; 2]);
    let data = Data { values: &[0.0, 1.0], noise: &noise };
    let z = DMatrix::zeros(2, 4);
    let lost = batch.step(&state, &z, &[true, false, false, false], &data);
    assert_eq!(lost.unwrap_err(), EstimatorError::StartFailed { attempt: 1 });
    let (mut closer, step) = batch.step(&state, &z, &[false, true, true, false], &data).unwrap();
    assert!(
        !step.accepted && !step.converged && closer.scale.amax() < state.scale.amax(),
        "nearer points are tried"
    );
    for _ in 0..2 {
        closer = batch.step(&closer, &z, &[false, true, true, false], &data).unwrap().0;
    }
    let never = batch.step(&closer, &z, &[false, true, true, false], &data);
    assert_eq!(never.unwrap_err(), EstimatorError::StartFailed { attempt: 4 });
    let shape = batch.step(&state, &z, &[false; 3], &data);
    assert_eq!(shape.unwrap_err(), EstimatorError::Shape { what: "failed particles", expected: 4, got: 3 });
}

#[test]
fn a_new_slope_at_the_same_centre_half_forgets_the_damping() {
    let prior = Gaussian::independent(&[0.0, 0.0], &[1.0, 1.0]);
    let batch = Batch::new(SigmaSet::new(Points::Simplex, 2).unwrap());
    let noise = Noise::Diagonal(vec![1.0; 2]);
    let data = Data { values: &[2.0, 1.0], noise: &noise };
    let model = |theta: &[f64]| theta.to_vec();
    let go = |state: &BatchState, lost: bool| {
        let (z, mut failed) = ensemble(&model, &batch.sample(state), 2);
        failed[0] = lost;
        batch.step(state, &z, &failed, &data).unwrap().0
    };
    let first = go(&batch.init(&prior), false);
    let mut state = first.clone();
    let mut steps = vec![];
    for _ in 0..4 {
        state = go(&state, true);
        steps.push(state.damping);
    }
    assert_eq!(state.trial, first.best.as_ref().unwrap().centre, "the best centre is linearised again");
    // 0.02 x 4 x 8 x 16 x 32 after four rejections, of which half the decades above 0.02 remain: nearer than after three.
    assert!(state.damping < steps[2] && state.damping > 0.02, "{} {steps:?}", state.damping);
    // Five more accepted ensembles of a linear model, each 0.3 of the last, are back below 0.02.
    for _ in 0..6 {
        state = go(&state, false);
    }
    assert!(state.damping < 0.02, "{}", state.damping);
}

#[test]
fn a_spread_that_is_not_positive_and_finite_is_refused() {
    let set = SigmaSet::new(Points::Simplex, 2).unwrap();
    let state = Batch::new(set.clone()).init(&Gaussian::independent(&[0.0, 0.0], &[1.0, 1.0]));
    let noise = Noise::Diagonal(vec![1.0; 2]);
    let data = Data { values: &[0.0, 1.0], noise: &noise };
    for spread in [0.0, -0.1, f64::INFINITY] {
        let batch = Batch { spread, ..Batch::new(set.clone()) };
        let refused = batch.step(&state, &DMatrix::zeros(2, 4), &[false; 4], &data).unwrap_err();
        assert_eq!(refused, EstimatorError::Spread { value: spread });
    }
}

#[test]
fn a_state_that_was_stored_goes_on_to_the_same_bits() {
    let values = pressure(&truth());
    let noise = Noise::Diagonal(vec![2.0 * MM_HG; values.len()]);
    let data = Data { values: &values, noise: &noise };
    let batch = Batch::new(SigmaSet::new(Points::Simplex, 4).unwrap());
    let go = |state: &BatchState| {
        let (z, failed) = ensemble(&pressure, &batch.sample(state), values.len());
        batch.step(state, &z, &failed, &data).unwrap()
    };
    let half = go(&go(&batch.init(&prior(0.7))).0).0;
    assert_eq!(go(&half), go(&half.clone()));
}
