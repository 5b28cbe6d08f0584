//! What the estimator does not see of an ensemble: the states of its particles, and the noise of its rows.

use nalgebra::DMatrix;
use starlings_estimators::Noise;

use super::flight::StepWindows;
use crate::Study;

/// X⁺ = X⁻T for the states of every record, by so many threads; the bits do not depend on them.
pub(super) fn recombine(states: &mut [Option<DMatrix<f64>>], transform: &DMatrix<f64>, threads: usize) {
    for x in states.iter_mut().flatten() {
        starlings_estimators::recombine(x, transform, threads);
    }
}

/// Noise sd of every row, in the order of the stacked predictions.
pub(super) fn noise(study: &Study, windows: &StepWindows, factor: f64) -> Noise {
    let sd = windows.iter().flat_map(|(record, window)| {
        let of_record = study.noise(*record);
        window.times.iter().flat_map(move |_| of_record.clone())
    });
    Noise::Diagonal(sd.map(|s| s * factor).collect())
}
