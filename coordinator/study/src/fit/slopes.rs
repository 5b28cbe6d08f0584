//! Runs that predict their derivatives, as the ensemble of sigma points that a batch fit takes.
//!
//! Next file to read: the `gauss_newton` module of `starlings-estimators`.

use nalgebra::{DMatrix, DVector, DVectorView};
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
    let (mut centre, mut slope) = (DVector::from_element(m, f64::NAN), DMatrix::zeros(m, p));
    let (at, n_obs) = (batch.centre(state), study.setup.outputs.len());
    let mut first = 0;
    for ((record, window), result) in windows.iter().zip(results) {
        let moves = study.theta_slopes(*record, at.as_slice());
        let outputs = result.as_ref().map_or(&[][..], |prediction| &prediction.outputs);
        for (time, values) in outputs.chunks_exact(n_obs * (1 + study.parameters.len())).enumerate() {
            let (values, derivatives) = values.split_at(n_obs);
            let row = first + time * n_obs;
            centre.rows_mut(row, n_obs).copy_from_slice(values);
            for &(value, entry, factor) in &moves {
                let by_value = DVectorView::from_slice(&derivatives[value * n_obs..], n_obs);
                slope.view_mut((row, entry), (n_obs, 1)).column_mut(0).axpy(factor, &by_value, 1.0);
            }
        }
        first += window.observed.len();
    }
    let failed = results.iter().any(Result::is_err);
    (batch.linear(state, &centre, &slope), vec![failed; batch.set.n_particle() + 1])
}
