//! Resampling for sigma sets with more points than an affine map needs: keep the leading directions of the whole spread.
//!
//! Only the r × r Gram matrix of the particles reaches the estimator. Predictions are taken again at the redrawn points by
//! runs of zero length. Source: Moireau & Chapelle (2011), Verdandi's treatment of the canonical and star sets.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::Particles;
use starlings_models::Window;

use super::flight::{Flight, Place, StepWindows, stack_outputs};
use crate::study::{RunError, Study};

/// Gram matrix (r × r) of the √α-weighted deviations of the augmented particles.
///
/// Rows are made commensurable: each state quantity by its size in the ensemble mean, each parameter by its prior sd.
/// Initial values have done their work through the states and do not count again.
pub fn gram(
    study: &Study,
    weights: &DVector<f64>,
    particles: &Particles,
    states: &[Option<DMatrix<f64>>],
) -> DMatrix<f64> {
    let mut gram = DMatrix::zeros(weights.len(), weights.len());
    for x in states.iter().flatten() {
        let mut first = 0;
        for quantity in &study.spec.states {
            let block = x.rows(first, quantity.size).into_owned();
            let mean = &block * weights;
            let size = (mean.norm_squared() / quantity.size as f64).sqrt();
            add(&mut gram, &block, weights, if size > 0.0 { size } else { 1.0 });
            first += quantity.size;
        }
    }
    for (j, entry) in study.theta.iter().enumerate() {
        if !study.parameters[entry.parameter].name.starts_with("initial:") {
            add(&mut gram, &particles.theta.rows(j, 1).into_owned(), weights, entry.prior_sd);
        }
    }
    gram
}

fn add(gram: &mut DMatrix<f64>, rows: &DMatrix<f64>, weights: &DVector<f64>, scale: f64) {
    let mean = rows * weights;
    let mut deviation = rows.clone();
    for (mut column, weight) in deviation.column_iter_mut().zip(weights.iter()) {
        column -= &mean;
        column *= weight.sqrt() / scale;
    }
    gram.gemm_tr(1.0, &deviation, &deviation, 1.0);
}

/// Predictions of the redrawn particles at the windows' ends, by runs of zero length.
///
/// # Errors
/// When the fleet fails or a redrawn particle has no prediction.
pub fn observe_again(
    flight: &mut Flight<'_>,
    place: Place,
    particles: &Particles,
    states: &[Option<DMatrix<f64>>],
    windows: &StepWindows,
) -> Result<DMatrix<f64>, RunError> {
    let instants: StepWindows = windows.iter().map(|(record, w)| (*record, Arc::new(instant(w)))).collect();
    let everyone: Vec<usize> = (0..particles.theta.ncols()).collect();
    let results = flight.run(place, &everyone, &particles.theta, states, &instants)?;
    for (particle, of_particle) in results.iter().enumerate() {
        if let Some(Err(source)) = of_particle.iter().find(|r| r.is_err()) {
            return Err(RunError::Resampled { particle, source: source.clone() });
        }
    }
    Ok(stack_outputs(&results))
}

/// The last instant of a window, as a window of its own.
fn instant(window: &Window) -> Window {
    let end = window.times.last().copied().unwrap_or(window.start);
    let n_obs = window.observed.len() / window.times.len().max(1);
    Window { start: end, times: vec![end], observed: vec![f64::NAN; n_obs], inputs: window.inputs.clone() }
}
