//! The parts of an ensemble that the estimator does not get: the states of its particles, and the noise of its rows.

use nalgebra::DMatrix;
use starlings_estimators::Noise;
use starlings_fleet::FleetError;

use super::runner::{EnsembleRunner, StepWindows};
use crate::Study;
use crate::states::States;

/// X⁺ = X⁻T for the states of every record; the bits do not depend on who makes it.
///
/// # Errors
/// When the store of states or the fleet fails.
pub(super) fn recombine(
    states: &mut [Option<States>],
    transform: &DMatrix<f64>,
    runner: &mut EnsembleRunner<'_>,
) -> Result<(), FleetError> {
    let threads = runner.threads;
    let fleet = runner.fleet();
    states.iter_mut().flatten().try_for_each(|x| x.recombine_on(fleet, transform, threads))
}

/// Noise sd of every row, in the order of the stacked predictions.
pub(super) fn noise(study: &Study, windows: &StepWindows, factor: f64) -> Noise {
    let sd = windows.iter().flat_map(|(record, window)| {
        let of_record = study.noise(*record);
        window.times.iter().flat_map(move |_| of_record.clone())
    });
    Noise::Diagonal(sd.map(|s| s * factor).collect())
}
