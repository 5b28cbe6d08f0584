//! The searches of a diagnosis, one after the other, and the noise in whose units each is made.
//!
//! The first counts in the noise as it was stated or found. Another one counts in the noise with a memory that the best supported version
//! shows. Where nothing explains the gap and the size of a noise was not stated, that may be larger than was found; if nothing explains the
//! gap in units of that either, what was found before stands. Next file to read: [`crate::judge::noise_model`].

use nalgebra::DVector;
use starlings_estimators::CorrelatedNoise;

use crate::judge::larger_noise::{in_larger_noise, leaves_little};
use crate::judge::noise_model::{alike, best_supported};
use crate::judge::search_result::SearchResult;
use crate::judge::verdict::{Decision, Verdict};
use crate::rows::Rows;
use crate::run_cache::RunCache;

/// Searches at most, each in units of the noise that the last one showed.
const MOST: usize = 3;

/// Where a search begins.
struct Begin {
    rows: Rows,
    /// Where the fit of the model as it is starts; at the prior for `None`.
    start: Option<DVector<f64>>,
}

/// The searches so far.
#[derive(Default)]
pub(crate) struct Rounds {
    n: usize,
    /// Where the fit of the search under way started.
    started: Option<DVector<f64>>,
    /// Where the next one starts.
    start: Option<DVector<f64>>,
    /// Where the search before began, if the one under way is in units of a noise larger than was found.
    smaller: Option<Begin>,
    /// Whether none follows.
    is_over: bool,
}

impl Rounds {
    /// Where the fit of the model as it is starts.
    pub(crate) fn start(&self) -> Option<DVector<f64>> {
        self.start.clone()
    }

    /// A search has begun, with the model as it is fitted here.
    pub(crate) fn begin(&mut self, fitted: &DVector<f64>) {
        self.started = self.start.replace(fitted.clone());
        self.n += 1;
    }

    /// The noise of the best supported version, where another search may be made in units of it and it is another one.
    pub(crate) fn another_noise(
        &self,
        cache: &RunCache<'_>,
        found: &SearchResult<'_>,
    ) -> Option<Vec<Option<CorrelatedNoise>>> {
        // A noise of a size that the residuals tell is the last that is asked of them.
        if self.is_over || self.smaller.is_some() || self.n >= MOST {
            return None;
        }
        let noise = best_supported(cache, found);
        (!noise.is_empty() && !alike(&noise, &cache.rows.noise)).then_some(noise)
    }

    /// Whether a decision stands: something is told, and if that was in units of a noise larger than was found, it is of a version whose residuals may
    /// be such a noise.
    pub(crate) fn stands(&self, found: &SearchResult<'_>, decision: &Decision) -> bool {
        let told = decision.best.map_or(&found.base, |best| &found.judged[best].fit);
        let told = if decision.verdict == Verdict::NoGap { &found.base } else { told };
        let is_believed = self.smaller.as_ref().is_none_or(|of| leaves_little(&of.rows, found, told));
        decision.verdict != Verdict::Unexplained && is_believed
    }

    /// The rows in whose units to search again after a search whose decision does not stand: a version that came in later may be the one
    /// whose residuals show what the noise is, or a noise that was found may be larger.
    pub(crate) fn after_nothing(&mut self, cache: &RunCache<'_>, found: &SearchResult<'_>) -> Option<Rows> {
        if let Some(Begin { rows, start }) = self.smaller.take() {
            // Its runs are known.
            (self.start, self.is_over) = (start, true);
            return Some(rows);
        }
        // As many runs again as all searches so far.
        if self.is_over || !cache.affords_runs(cache.runs()) {
            return None;
        }
        if let Some(noise) = self.another_noise(cache, found) {
            return Some(Rows { noise, ..cache.rows.clone() });
        }
        let rows = in_larger_noise(cache, found)?;
        self.smaller = Some(Begin { rows: cache.rows.clone(), start: self.started.take() });
        Some(rows)
    }
}
