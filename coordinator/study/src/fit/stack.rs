//! Predictions as the columns of matrices, one per particle.

use nalgebra::DMatrix;

use starlings_fleet::StateError;

use super::runner::{Results, StepWindows};
use crate::states::States;

/// Stacks the predictions of all particles: m × r, rows by window, then time, then output. A failed particle's column is
/// zero and must be masked by the caller.
pub(crate) fn stack_outputs(results: &Results, windows: &StepWindows) -> DMatrix<f64> {
    let columns: Vec<Vec<f64>> = results
        .iter()
        .map(|windows| windows.iter().flatten().flat_map(|p| p.outputs.iter().copied()).collect())
        .collect();
    let m = windows.iter().map(|(_, window)| window.observed.len()).sum();
    DMatrix::from_fn(m, columns.len(), |row, column| columns[column].get(row).copied().unwrap_or(0.0))
}

/// The states of all particles at the end of window `index`. That of a failed particle is zero.
///
/// # Errors
/// When the store of states fails.
pub(crate) fn stack_states(results: &Results, index: usize) -> Result<States, StateError> {
    States::gather(results.iter().map(|windows| windows[index].as_ref().ok().map(|p| &p.state)))
}
