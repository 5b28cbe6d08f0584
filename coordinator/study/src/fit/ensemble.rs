//! The parts of an ensemble that the estimator does not get: the states of its particles, and the noise of its rows.

use nalgebra::DMatrix;
use starlings_estimators::{Noise, Recombination};

use super::runner::StepWindows;
use crate::Study;

/// X⁺ = X⁻T for the states of every record, by up to so many threads; the bits do not depend on their number.
pub(super) fn recombine(states: &mut [Option<DMatrix<f64>>], transform: &DMatrix<f64>, threads: usize) {
    for x in states.iter_mut().flatten() {
        recombine_by(x, transform, threads);
    }
}

/// X⁺ = X⁻T by up to so many threads, of which the caller's is one.
pub fn recombine_by(x: &mut DMatrix<f64>, transform: &DMatrix<f64>, threads: usize) {
    let mut shares = Recombination::shares(x, transform, threads);
    let Some(own) = shares.pop() else { return };
    std::thread::scope(|scope| {
        for share in shares {
            scope.spawn(|| share.run());
        }
        own.run();
    });
}

/// Noise sd of every row, in the order of the stacked predictions.
pub(super) fn noise(study: &Study, windows: &StepWindows, factor: f64) -> Noise {
    let sd = windows.iter().flat_map(|(record, window)| {
        let of_record = study.noise(*record);
        window.times.iter().flat_map(move |_| of_record.clone())
    });
    Noise::Diagonal(sd.map(|s| s * factor).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_shared_out_over_threads_have_the_bits_of_rows_made_alone() {
        // Just past the size from which threads share the work, and no multiple of any block.
        let (n, r) = (200_003, 22);
        let x = DMatrix::from_fn(n, r, |i, j| ((i * 31 + j * 17) % 1009) as f64 / 7.0);
        let t = DMatrix::from_fn(r, r, |i, j| 1.0 / (1 + i + 2 * j) as f64);
        let mut whole = x.clone();
        recombine_by(&mut whole, &t, 3);
        for first in (0..n).step_by(50_021) {
            let rows = 50_021.min(n - first);
            let mut part = x.rows(first, rows).into_owned();
            starlings_estimators::recombine(&mut part, &t);
            assert!(part == whole.rows(first, rows), "rows from {first}");
        }
    }
}
