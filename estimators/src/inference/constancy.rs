//! Whether the coefficients are the same throughout a recording: what lies behind each of its seams tested against what lies before.
//!
//! All seams share the rate of false alarms (Bonferroni). Read next: `change.rs`, the test.

use super::{Fit, InferenceError, Structure, Sums, compare};

/// Where coefficients change most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seam {
    /// Number of the piece with which they are others, from 1 on.
    pub piece: usize,
    /// Probability, at most, of so improbable a seam among all in a recording without a change.
    pub by_chance: f64,
}

/// The seam between neighbouring pieces of a recording at which the coefficients change most; `None` where no seam has enough before it to
/// estimate them.
pub fn most_changed(pieces: &[&Sums], fit: &Fit, structure: &Structure) -> Option<Seam> {
    let sums = |pieces: &[&Sums]| Sums::of(pieces.iter().copied()).and_then(|sums| sums.ok_or(EMPTY));
    let probability = |seam: usize| {
        let reference = fit.posterior(&sums(&pieces[..seam])?, structure)?;
        compare(&reference, &sums(&pieces[seam..])?, structure, &[]).map(|change| change.probability)
    };
    // Too few steps before a seam, or functions that are not seen there, say nothing of it.
    let tests = (1..pieces.len()).filter_map(|seam| Some((seam, probability(seam).ok()?)));
    let (piece, least) = tests.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    Some(Seam { piece, by_chance: (least * (pieces.len() - 1) as f64).min(1.0) })
}

/// What a stretch without pieces says.
const EMPTY: InferenceError = InferenceError::NothingObserved;
