//! Candidates whose influence is that of what is told, to first order.
//!
//! How well a refit would tell two influences apart depends on how much there is to tell: of a gain of a hundred thousand a part of a thousandth
//! that they do not share decides. Next file to read: [`super::verdict`], where those that were not refitted are tied.

use super::gates::JudgedFit;
use super::rivals::MARGIN;
use super::search_result::SearchResult;
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::run_cache::RunCache;
use crate::screen::screening_result::ScreeningResult;

/// Correlation of two influences above which they are the same to first order.
pub(crate) const ALIKE: f64 = 0.995;

/// A candidate that was not refitted and whose influence is that of what is told.
pub(crate) struct Twin<'h, 'c> {
    pub(crate) candidate: &'c Candidate,
    pub(crate) result: &'h ScreeningResult,
    /// Correlation of the two influences.
    alike: f64,
    /// Whether the part of the gain that the two do not share is beyond the margin: a refit tells which it is.
    pub(crate) is_told_apart: bool,
}

impl Twin<'_, '_> {
    /// Whether it is tied as long as it is not refitted. Forms that stand for no cause are made by the dozen, and the nearest were refitted.
    pub(crate) fn is_tied(&self) -> bool {
        !(self.is_told_apart && self.candidate.kind.is_of_no_field())
    }
}

/// The twins of what is told, each once; none of more than one effect.
///
/// # Errors
/// When the store fails.
pub(crate) fn twins<'h, 'c>(
    cache: &RunCache<'_>,
    found: &'h SearchResult<'_>,
    judged: &JudgedFit<'_>,
    candidates: &'c [Candidate],
) -> Result<Vec<Twin<'h, 'c>>, ExplainError> {
    let [effect] = judged.fit.variant.effects.as_slice() else { return Ok(Vec::new()) };
    let Ok(optimum) = found.base.optimum() else { return Ok(Vec::new()) };
    let own = |result: &ScreeningResult| {
        Ok::<_, ExplainError>(optimum.unimitated(&result.influence.of_train(cache)?))
    };
    let best = found.screening.iter().filter(|h| h.candidate == effect.index && h.failure.is_none());
    let Some(best) = best.max_by(|a, b| a.score.gain.total_cmp(&b.score.gain)) else { return Ok(Vec::new()) };
    let (gain, best) = (best.score.gain, own(best)?);
    let is_refitted = |result: &ScreeningResult| {
        let alone = |j: &&JudgedFit<'_>| j.fit.variant.effects.len() == 1;
        found.judged.iter().filter(alone).any(|j| j.fit.variant.effects[0].index == result.candidate)
    };
    let mut twins: Vec<Twin<'h, 'c>> = Vec::new();
    for result in found.screening.iter().filter(|h| h.failure.is_none() && !h.is_absorbed()) {
        let candidate = &candidates[result.candidate];
        if is_refitted(result) || result.allowed_gain(candidate.sign()) <= 0.0 {
            continue;
        }
        let other = own(result)?;
        let alike = best.dot(&other).abs() / (best.norm() * other.norm());
        if alike <= ALIKE {
            continue;
        }
        let new = Twin {
            candidate,
            result,
            alike,
            is_told_apart: gain * (1.0 - alike * alike) > MARGIN * judged.inflation,
        };
        match twins.iter_mut().find(|twin| twin.candidate.name() == candidate.name()) {
            // The point of its grid at which it is most alike stands for it.
            Some(known) if known.alike < alike => *known = new,
            Some(_) => {}
            None => twins.push(new),
        }
    }
    Ok(twins)
}
