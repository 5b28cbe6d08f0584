//! How a search goes on where it found no name, or one that leaves much: with one more kind of candidates, and with pairs of them.
//!
//! Next file to read: [`super::pairs`].

use super::search::{ASKED, Searcher};
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::kind::Kind;
use crate::judge::search_result::SearchResult;
use crate::locate::Track;
use crate::options::Options;
use crate::run_cache::{Course, RunCache};

/// Goes on with candidates of one more kind that promise a fall of χ² above `wanted`, one at a time, where none of those before explains the
/// gap. Whether there is any.
///
/// # Errors
/// As [`super::search::search`].
pub(crate) fn search_further<'c>(
    cache: &mut RunCache<'_>,
    found: &mut SearchResult<'c>,
    candidates: &'c [Candidate],
    tracks: &[Track],
    options: &Options,
    (tried, wanted): (&'static [Kind], f64),
) -> Result<bool, ExplainError> {
    let mut of_kind = candidates.iter().filter(|c| tried.contains(&c.kind));
    let Some(kind) = of_kind.next().map(|c| c.kind).filter(|_| options.only.is_empty()) else {
        return Ok(false);
    };
    let mut searcher = Searcher { cache, candidates, tracks, cut_short: false, asked: false, tried };
    searcher.cache.foreseen.goes(Course::Open);
    let since = if wanted > 0.0 {
        "what explains the gap leaves more than noise"
    } else {
        "no other effect explains the gap"
    };
    searcher.cache.stage("screen", &format!("{}, since {since}", kind.plural()));
    let screening = searcher.screen_all(&found.base)?;
    let mut best = searcher.best_of_each(&screening);
    best.retain(|h| h.score.gain > wanted);
    if best.is_empty() && wanted > 0.0 {
        return Ok(false);
    }
    searcher.widen(found, screening)?;
    searcher.refit_singles(found, &best)?;
    searcher.refit_near_priors(found)?;
    searcher.second_pass(found, &Options { max_effects: 1, ..options.clone() })?;
    found.cut_short |= searcher.cut_short || searcher.cache.was_cut_short();
    Ok(true)
}

/// Goes on with pairs that have a generic term, where nothing else explains the gap.
///
/// # Errors
/// As [`super::search::search`].
pub(crate) fn search_generic_pairs<'c>(
    cache: &mut RunCache<'_>,
    found: &mut SearchResult<'c>,
    candidates: &'c [Candidate],
    tracks: &[Track],
    options: &Options,
) -> Result<bool, ExplainError> {
    let has_generic = found.screening.iter().any(|h| candidates[h.candidate].kind == Kind::Generic);
    if !has_generic || !options.only.is_empty() || options.max_effects < 2 {
        return Ok(false);
    }
    let mut searcher = Searcher { cache, candidates, tracks, cut_short: false, asked: false, tried: ASKED };
    searcher.refit_pairs(found)?;
    searcher.refit_simpler(found)?;
    searcher.second_pass(found, options)?;
    found.cut_short |= searcher.cut_short || searcher.cache.was_cut_short();
    Ok(true)
}
