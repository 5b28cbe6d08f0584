//! Runs that predict their derivatives, as the ensemble of sigma points that a batch fit takes.
//!
//! Next file to read: the `gauss_newton` module of `starlings-estimators`.

use nalgebra::{DMatrix, DVector};
use starlings_estimators::{Batch, BatchState};

use super::runner::{Predicted, StepWindows};
use crate::Study;

/// About how many plain runs one with slopes takes; `models/core/benches/sensitivities.rs` measures it.
pub(super) fn weight(study: &Study) -> usize {
    3 + study.parameters.len() / 2
}

/// What the sigma points would predict where the model is linear around the centre, and which of them failed: all where the run of a record
/// did. `results` has the run of every window, with its derivatives.
pub(super) fn as_points(
    study: &Study,
    batch: &Batch,
    state: &BatchState,
    results: &[Predicted],
    windows: &StepWindows,
) -> (DMatrix<f64>, Vec<bool>) {
    let (m, p) = (windows.iter().map(|(_, w)| w.observed.len()).sum(), study.theta.len());
    let at = batch.centre(state);
    let (mut centre, mut slope) = (DVector::from_element(m, f64::NAN), DMatrix::zeros(m, p));
    let mut first = 0;
    for ((record, window), result) in windows.iter().zip(results) {
        let rows = window.observed.len();
        if let Ok(prediction) = result {
            let n_obs = rows / window.times.len().max(1);
            let moves = study.theta_slopes(*record, at.as_slice());
            let of_time = prediction.outputs.chunks_exact(n_obs * (1 + study.parameters.len()));
            for (row, values) in (first..).step_by(n_obs.max(1)).zip(of_time) {
                for i in 0..n_obs {
                    centre[row + i] = values[i];
                    for &(value, entry, factor) in &moves {
                        slope[(row + i, entry)] += values[(1 + value) * n_obs + i] * factor;
                    }
                }
            }
        }
        first += rows;
    }
    let failed = results.iter().any(Result::is_err);
    (batch.linear(state, &centre, &slope), vec![failed; batch.set.n_particle() + 1])
}
