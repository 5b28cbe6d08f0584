//! Refits of what has the influence of what is told, where there is enough of it to tell them apart.
//!
//! Next file to read: [`crate::judge::twins`].

use super::race::SMALL;
use super::search::{FIRST, Searcher};
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::judge::search_result::SearchResult;
use crate::judge::twins::twins;
use crate::locate::Track;
use crate::options::Options;
use crate::run_cache::{Course, RunCache};
use crate::screen::screening_result::ScreeningResult;

/// Refits the twins of what is told at a position that a refit would tell from it. Whether there was any.
///
/// # Errors
/// As [`super::search::search`].
pub(crate) fn refit_twins<'c>(
    cache: &mut RunCache<'_>,
    found: &mut SearchResult<'c>,
    candidates: &'c [Candidate],
    tracks: &[Track],
    options: &Options,
    told: usize,
) -> Result<bool, ExplainError> {
    let judged = &found.judged[told];
    if !judged.fit.variant.left_out.is_empty() {
        return Ok(false);
    }
    let apart = twins(cache, found, judged, candidates)?;
    let apart = apart.iter().filter(|twin| twin.is_told_apart && twin.is_tied());
    let apart: Vec<ScreeningResult> = apart.map(|twin| twin.result.clone()).collect();
    if apart.is_empty() {
        return Ok(false);
    }
    let mut searcher = Searcher { cache, candidates, tracks, cut_short: false, asked: false, tried: FIRST };
    searcher.cache.foreseen.goes(Course::Open);
    let best = searcher.best_of_each(&apart);
    // As many at a time as are refitted without a race, whose steps are too short to tell them apart.
    for some in best.chunks(SMALL) {
        let fits = searcher.race_and_refit(&found.base, some, &found.screening)?;
        searcher.judge_all(found, fits)?;
    }
    if found.judged.first().is_some_and(|first| first.leftover.is_none()) {
        searcher.second_pass(found, &Options { max_effects: 1, ..options.clone() })?;
    }
    found.cut_short |= searcher.cut_short || searcher.cache.was_cut_short();
    Ok(true)
}
