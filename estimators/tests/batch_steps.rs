//! The steps of the batch fit: runs that fail, damping, what is refused, and going on from a stored state.
#![allow(clippy::unwrap_used)]
mod common;

use common::batch::{compartments, ensemble, fit};
use common::rcr::{MM_HG, pressure, prior, truth};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::{
    Batch, BatchState, Block, Data, EstimatorError, Gaussian, Noise, Points, SigmaSet,
};

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

/// Two shared parameters and one of its own for each of three records of four rows, slightly curved.
fn of_three_records(theta: &[f64]) -> Vec<f64> {
    let row = |k: usize, i: usize| {
        let x = i as f64 / 3.0 + 0.1 * k as f64;
        theta[0] + theta[1] * x + theta[2 + k] * (1.0 + x * x) + 0.01 * (theta[0] * theta[2 + k]).powi(2)
    };
    (0..3).flat_map(|k| (0..4).map(move |i| row(k, i))).collect()
}

#[test]
fn a_fit_in_blocks_is_the_fit_of_the_whole_with_fewer_points() {
    let prior = Gaussian::independent(&[0.0; 5], &[1.0, 2.0, 1.0, 0.5, 3.0]);
    let values = of_three_records(&[0.4, -0.3, 1.2, 0.7, -0.9]);
    let noise = Noise::Diagonal(vec![0.1; 12]);
    let data = Data { values: &values, noise: &noise };
    let block = |k: usize| Block { rows: 4 * k..4 * k + 4, parameters: vec![0, 1, 2 + k] };
    let blocks: Vec<Block> = (0..3).map(block).collect();
    let go = |set: SigmaSet, blocks: Vec<Block>| {
        let batch = Batch { blocks, tolerance: 1e-6, spread: 1e-3, ..Batch::new(set) };
        let mut state = batch.init(&prior);
        for _ in 0..batch.max_iterations {
            let theta = batch.sample(&state);
            let (z, failed) = ensemble(&of_three_records, &theta, 12);
            let (next, step) = batch.step(&state, &z, &failed, &data).unwrap();
            state = next;
            if step.converged {
                return (step, theta.ncols());
            }
        }
        panic!("it converges")
    };
    let (whole, n_whole) = go(SigmaSet::new(Points::Simplex, 5).unwrap(), Vec::new());
    let (parts, n_parts) = go(SigmaSet::new(Points::Simplex, 3).unwrap(), blocks.clone());
    assert_eq!((n_whole, n_parts), (7, 5));
    // Both are at the mode; slopes over a thousandth of an sd differ from the derivative by its square.
    let sd = whole.posterior.covariance.diagonal().map(f64::sqrt);
    assert!((&whole.posterior.mean - &parts.posterior.mean).component_div(&sd).amax() < 1e-4);
    let apart = (&whole.posterior.covariance - &parts.posterior.covariance).amax();
    assert!(apart < 1e-5 * whole.posterior.covariance.amax(), "{apart:e}");
    assert!((whole.evidence - parts.evidence).abs() < 1e-4, "{} {}", whole.evidence, parts.evidence);

    let correlated = Noise::Dense(DMatrix::identity(12, 12));
    let batch = Batch { blocks, ..Batch::new(SigmaSet::new(Points::Simplex, 3).unwrap()) };
    let data = Data { values: &values, noise: &correlated };
    let refused = batch.step(&batch.init(&prior), &DMatrix::zeros(12, 5), &[false; 5], &data).unwrap_err();
    assert_eq!(refused, EstimatorError::CorrelatedBlocks);
}

#[test]
fn a_point_that_fails_in_one_block_is_left_out_there_alone() {
    let prior = Gaussian::independent(&[0.0; 4], &[1.0; 4]);
    let noise = Noise::Diagonal(vec![0.1; 8]);
    let truth = [0.5, 0.2, -0.4, 0.8];
    let model = |t: &[f64]| -> Vec<f64> {
        (0..2)
            .flat_map(|k| (0..4).map(move |i| (k, i)))
            .map(|(k, i)| t[0] + t[1 + k] * i as f64 + t[3])
            .collect()
    };
    let values = model(&truth);
    let data = Data { values: &values, noise: &noise };
    let block = |k: usize| Block { rows: 4 * k..4 * k + 4, parameters: vec![0, 3, 1 + k] };
    // Twice as many points as parameters: one may be missing.
    let set = SigmaSet::new(Points::Canonical, 3).unwrap();
    let batch = Batch { blocks: (0..2).map(block).collect(), ..Batch::new(set) };
    let state = batch.init(&prior);
    let theta = batch.sample(&state);
    let (mut z, failed) = ensemble(&model, &theta, 8);
    let clean = batch.step(&state, &z, &failed, &data).unwrap().1;
    z.view_mut((4, 2), (4, 1)).fill(f64::NAN);
    let step = batch.step(&state, &z, &failed, &data).unwrap().1;
    // The model is linear: the other points tell the same slope.
    assert!((&step.posterior.covariance - &clean.posterior.covariance).amax() < 1e-10);
    z.view_mut((4, 0), (4, 1)).fill(f64::NAN);
    let lost = batch.step(&state, &z, &failed, &data).unwrap_err();
    assert_eq!(lost, EstimatorError::StartFailed { attempt: 1 });
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
