//! Whether the recording's steps are coarse for the dynamics that was found: its first rows at h, 2h and 4h, in pieces.
//!
//! They are read here, whoever reads the recording: a few milliseconds, whatever its length. Next file to read: `words.rs`, which says it.

use starlings_estimators::inference::{
    Decimation, InferenceError, StepError, Sums, noise_errors, step_errors, step_in_rates,
};
use starlings_study::infer_choice::MeasuredChoice;

use crate::answer::Answer;
use crate::blocks::{Blocks, Cut, Start, open};
use crate::error::InferError;
use crate::result::LEVEL;
use crate::run::Asked;

/// Pieces that are compared with one another.
const PIECES: usize = 16;
/// Steps of a piece, at least and at most.
const LEAST: usize = 16;
const MOST: usize = 1024;
/// Steps times the drift's fastest rate from which steps are coarse where twice as long ones have no fit: there a rate is found wrong by 1 %
/// at least, the (λh)²/12 of a path without noise.
const RATES: f64 = 0.35;

/// What the step does to the estimates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Coarse {
    /// These coefficients would move out of their intervals.
    Moved(Vec<StepError>),
    /// They would by a third at least of how far they move from twice the step; four times the step has no fit to extrapolate from.
    Moving(Vec<StepError>),
    /// The noise moves them out of their intervals with the step, by the drift that was found.
    Noise(Vec<StepError>),
    /// A step is so many times the fastest time of the drift, and longer steps have no fit to compare with.
    Fast(f64),
}

/// Looks whether steps are coarse; `None` where they are not, where errors of the measurement or an interpolation hide it, or where the study
/// extrapolates.
pub(crate) fn coarse(asked: &Asked<'_>, answer: &Answer, sums: &Sums, cut: Cut, at: Start) -> Option<Coarse> {
    let choice = asked.choice;
    let is_known = matches!(choice.measured, MeasuredChoice::Known(_));
    if choice.sums.levels > 1 || choice.resample || is_known || answer.has_errors() {
        return None;
    }
    let found = pieces(asked, cut, at).ok().and_then(|pieces| compared(asked, answer, sums, &pieces));
    // The first rows alone know coefficients less well than a long recording.
    let by_noise = || {
        let moved = noise_errors(sums, &asked.question.structure, &answer.posterior, LEVEL);
        (choice.prefactor && !moved.is_empty()).then_some(Coarse::Noise(moved))
    };
    found.or_else(by_noise)
}

/// What longer steps of the first rows say.
fn compared(asked: &Asked<'_>, answer: &Answer, sums: &Sums, pieces: &[[Sums; 3]]) -> Option<Coarse> {
    let structure = &asked.question.structure;
    let errors = |n_level| step_errors(pieces, n_level, &answer.fit, structure, &answer.posterior, LEVEL);
    match errors(3) {
        Ok(moved) => return (!moved.is_empty()).then_some(Coarse::Moved(moved)),
        Err(InferenceError::Shape { .. }) => return None,
        // A longer step without a fit, or with one that holds other coefficients, may still be too long to be compared.
        Err(_) => {}
    }
    match errors(2) {
        Ok(moving) => (!moving.is_empty()).then_some(Coarse::Moving(moving)),
        // Pieces that do not compare say nothing of the step.
        Err(InferenceError::Incompatible { .. }) => None,
        Err(_) => {
            let rates = step_in_rates(sums, &answer.posterior);
            (rates > RATES).then_some(Coarse::Fast(rates))
        }
    }
}

/// Sums at h, 2h and 4h of the first pieces of the first recording.
fn pieces(asked: &Asked<'_>, cut: Cut, at: Start) -> Result<Vec<[Sums; 3]>, InferError> {
    let Some(record) = asked.choice.records.first() else { return Ok(Vec::new()) };
    let [from, to] = [record.span[0].max(at.first), record.span[1].min(at.first + at.n_row * at.step)];
    let n_row = ((to - from) / at.step).max(0.0);
    let n_step = ((n_row / PIECES as f64) as usize).clamp(LEAST, MOST);
    let cut = Cut { bytes: None, block: n_step, ahead: 0, ..cut };
    let mut blocks = Blocks::new((0, record), open(record)?, cut);
    let basis = &asked.question.basis;
    let mut pieces = Vec::with_capacity(PIECES);
    while pieces.len() < PIECES
        && let Some(block) = blocks.next()?
    {
        let mut levels = Decimation::new(basis, cut.step, 3)?;
        for (time, row) in block.times.iter().zip(block.rows.chunks_exact(basis.n_channel())) {
            levels.push(*time, row)?;
        }
        let sums = <[Sums; 3]>::try_from(levels.sums()?);
        // What is left at the end of a short recording is no piece.
        pieces.extend(sums.ok().filter(|_| block.n_step >= LEAST));
    }
    Ok(pieces)
}
