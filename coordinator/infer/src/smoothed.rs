//! The posterior from a smoothed path, where the standard deviation of the measurement is known.
//!
//! Smoothing goes through a recording back and forth, so that it is held in memory: the one way in which memory grows with a
//! recording. It is computed here and not on the fleet. Next file to read: `answer.rs`.

use nalgebra::DMatrix;
use starlings_estimators::inference::{Fit, Iteration, Measured, Noisy, NoisyPosterior};
use starlings_sums::Question;

use crate::blocks::{Blocks, Cut, open};
use crate::error::InferError;
use crate::progress::Teller;
use starlings_study::infer_choice::InferRecord;

/// Rounds of smoothing and fitting, and the growth of the likelihood at which they end.
const ITERATION: Iteration = Iteration { most: 100, tolerance: 1e-3 };

/// What is said of a smoothing that ended before it converged.
pub(crate) fn not_converged(converged: bool, rounds: usize) -> Option<String> {
    (!converged).then(|| {
        format!(
            "smoothing has not converged after {rounds} rounds: coefficients and noise may still move, which their intervals do not hold"
        )
    })
}

/// Smooths the one recording of a study under errors of standard deviation `sd` in every state, and fits.
pub(crate) fn smoothed(
    question: &Question,
    fit: &Fit,
    records: &[InferRecord],
    cut: Cut,
    sd: f64,
    teller: &mut Teller<'_>,
) -> Result<NoisyPosterior, InferError> {
    let [record] = records else {
        return Err(InferError::Setting("smoothing takes one recording".to_owned()));
    };
    let mut blocks = Blocks::new((0, record), open(record)?, Cut { ahead: 0, breaks: false, ..cut });
    let (mut times, mut rows) = (Vec::new(), Vec::new());
    let width = question.basis.n_channel();
    while let Some(block) = blocks.next()? {
        // The first row of a block is the last one of that before it.
        let skip = usize::from(!times.is_empty());
        times.extend_from_slice(&block.times[skip..]);
        rows.extend_from_slice(&block.rows[skip * width..]);
    }
    let n = question.basis.n_state();
    let noise = Measured::Known(DMatrix::from_diagonal_element(n, n, sd * sd));
    let noisy = Noisy { basis: &question.basis, step: cut.step, times: &times, rows: &rows };
    let mut watch = |log: &[f64]| teller.round(log, ITERATION.tolerance, ITERATION.most);
    Ok(noisy.infer_watched(fit, &question.structure, &noise, ITERATION, &mut watch)?)
}

#[cfg(test)]
mod tests {
    use super::not_converged;

    #[test]
    fn smoothing_that_has_not_converged_is_said_with_its_rounds() {
        let said = not_converged(false, 100);
        assert!(said.is_some_and(|said| said.contains("not converged after 100 rounds")));
        assert_eq!(not_converged(true, 100), None);
    }
}
