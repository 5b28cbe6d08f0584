//! The parts of an ensemble that the estimator does not get: the states of its particles, and the noise of its rows.

use nalgebra::DMatrix;
use starlings_estimators::Noise;
use starlings_fleet::StateError;

use super::runner::StepWindows;
use crate::Study;
use crate::states::States;

/// X⁺ = X⁻T for the states of every record, by up to so many threads; the bits do not depend on their number.
///
/// # Errors
/// When the store of states fails.
pub(super) fn recombine(
    states: &mut [Option<States>],
    transform: &DMatrix<f64>,
    threads: usize,
) -> Result<(), StateError> {
    states.iter_mut().flatten().try_for_each(|x| x.recombine(transform, threads))
}

/// Noise sd of every row, in the order of the stacked predictions.
pub(super) fn noise(study: &Study, windows: &StepWindows, factor: f64) -> Noise {
    let sd = windows.iter().flat_map(|(record, window)| {
        let of_record = study.noise(*record);
        window.times.iter().flat_map(move |_| of_record.clone())
    });
    Noise::Diagonal(sd.map(|s| s * factor).collect())
}
