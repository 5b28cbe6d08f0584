//! The search: screen all candidates, refit the best, and start a second pass from the best of these.
//!
//! [`crate::screen::screening`] scores every candidate at the fitted model. The best run a short race, whose first step costs
//! one run each; the first few of it are refitted with every parameter free and judged ([`crate::judge::gates`]). The second
//! pass ([`super::second_pass`]) scores the candidates again at the best variant and tries replacements and pairs. Terms that
//! the study calls replaceable are left out in turn, and the search is repeated without them. Next file to read:
//! [`crate::judge::verdict`].

use std::cmp::Ordering;

use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::drive::{drive, drive_rounds};
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::model_variant::{AddedEffect, ModelVariant};
use crate::judge::adequacy::Adequacy;
use crate::judge::gates::{JudgedFit, judge};
use crate::judge::held_out::held_out;
use crate::judge::misfit::Misfit;
use crate::judge::null_distribution::NullDistribution;
use crate::judge::search_result::SearchResult;
use crate::locate::Track;
use crate::options::Options;
use crate::run_cache::RunCache;
use crate::screen::screening::screen;
use crate::screen::screening_result::ScreeningResult;

/// Candidates that run the race.
const RACE: usize = 8;
/// Rounds of the race.
const ROUNDS: usize = 2;
/// Candidates that are refitted after it.
const FINAL: usize = 3;
/// Candidates with the best scores that are refitted whatever the race says.
const SCORED: usize = 2;
/// Of at most so many candidates all are refitted, since a linear score can be wrong where the misfit is large.
const SMALL: usize = 6;
/// Further candidates are refitted when the race promises a cost within this many units of the effective noise of the best.
const CLOSE: f64 = 12.0;

/// What the stages of a search share.
pub(super) struct Searcher<'s, 'l, 'c> {
    pub(super) cache: &'s mut RunCache<'l>,
    pub(super) candidates: &'c [Candidate],
    pub(super) tracks: &'s [Track],
    pub(super) cut_short: bool,
}

/// Searches from a fitted model.
///
/// # Errors
/// When the fleet or the store fails, or the fit leaves a direction free.
pub(crate) fn search<'c>(
    cache: &mut RunCache<'_>,
    base: FittedVariant<'c>,
    candidates: &'c [Candidate],
    tracks: &[Track],
    options: &Options,
) -> Result<SearchResult<'c>, ExplainError> {
    let mut searcher = Searcher { cache, candidates, tracks, cut_short: false };
    let before = Misfit::of(searcher.cache, &base);
    let adequacy = Adequacy::of(searcher.cache, &base);
    let held_out = held_out(searcher.cache, &base, &base);
    searcher.cache.stage("screen", &format!("{} candidates", candidates.len()));
    let screening = searcher.screen_all(&base)?;
    let null_distribution = null_distribution(searcher.cache, &base, &screening, candidates)?;
    let largest_gain =
        screening.iter().map(|h| h.allowed_gain(candidates[h.candidate].sign())).fold(0.0, f64::max);
    let (judged, cut_short) = (Vec::new(), false);
    let mut found = SearchResult {
        base,
        before,
        adequacy,
        held_out,
        null_distribution,
        screening,
        largest_gain,
        judged,
        cut_short,
    };
    if adequacy.is_gap() || largest_gain > found.null_distribution.threshold {
        searcher.refit_singles(&mut found)?;
        searcher.replace_terms(&mut found)?;
        searcher.second_pass(&mut found, options)?;
    }
    found.cut_short = searcher.cut_short || searcher.cache.was_cut_short();
    Ok(found)
}

/// The scores that a search reaches by chance at a fit.
fn null_distribution(
    cache: &RunCache<'_>,
    fit: &FittedVariant<'_>,
    screening: &[ScreeningResult],
    candidates: &[Candidate],
) -> Result<NullDistribution, ExplainError> {
    let (rows, seed) = (&cache.rows, cache.study.seed);
    let at_a_time = cache.series_held();
    let of_train = |result: &ScreeningResult| result.influence.of_train(cache);
    NullDistribution::new(&fit.optimum()?, rows, screening, candidates, seed, at_a_time, &of_train)
}

impl<'c> Searcher<'_, '_, 'c> {
    fn screen_all(&mut self, fit: &FittedVariant<'c>) -> Result<Vec<ScreeningResult>, ExplainError> {
        let of: Vec<(usize, usize)> = self
            .candidates
            .iter()
            .enumerate()
            .flat_map(|(c, candidate)| (0..candidate.points.len()).map(move |p| (c, p)))
            .collect();
        self.screen(fit, &of)
    }

    pub(super) fn screen(
        &mut self,
        fit: &FittedVariant<'c>,
        of: &[(usize, usize)],
    ) -> Result<Vec<ScreeningResult>, ExplainError> {
        if !self.cache.affords(of.len()) {
            self.cut_short = true;
            return Ok(Vec::new());
        }
        screen(self.cache, fit, self.candidates, of, self.tracks)
    }

    /// Refits the best candidates, one effect each.
    fn refit_singles(&mut self, found: &mut SearchResult<'c>) -> Result<(), ExplainError> {
        let best = self.best_of_each(&found.screening);
        let fits = self.race_and_refit(&found.base, &best)?;
        self.judge_all(found, fits)
    }

    /// The best point of the grid of every candidate that could be named, largest gain first.
    pub(super) fn best_of_each(&self, screening: &[ScreeningResult]) -> Vec<ScreeningResult> {
        let gain = |h: &ScreeningResult| h.allowed_gain(self.candidates[h.candidate].sign());
        let mut best: Vec<ScreeningResult> = Vec::new();
        for result in screening.iter().filter(|h| h.failure.is_none() && !h.is_absorbed() && gain(h) > 0.0) {
            match best.iter_mut().find(|b| b.candidate == result.candidate) {
                Some(known) if gain(result) > gain(known) => known.clone_from(result),
                Some(_) => {}
                None => best.push(result.clone()),
            }
        }
        best.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
        best
    }

    /// Adds single candidates to a fit: a race among the best, then refits of the first few. Where recordings are long, the
    /// race is made with a few at a time, and repeated for those that are refitted; the cache has its runs.
    fn race_and_refit(
        &mut self,
        parent: &FittedVariant<'c>,
        best: &[ScreeningResult],
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        self.cache.stage("refit", "a race among the best candidates");
        let racing = &best[..best.len().min(RACE)];
        let at_a_time = self.fits_held(parent);
        let (mut raced, mut promised) = (Vec::new(), Vec::new());
        for some in racing.chunks(at_a_time) {
            raced.clear();
            raced.extend(self.race(parent, some)?.into_iter().map(Some));
            promised.extend(raced.iter().flatten().map(FittedVariant::promised));
        }
        let finalists = self.finalists(best, &promised);
        self.cache.stage("refit", &format!("{} candidates with every parameter free", finalists.len()));
        if racing.len() <= at_a_time {
            return self.refit(finalists.into_iter().filter_map(|i| raced[i].take()).collect());
        }
        drop(raced);
        let mut fits = Vec::with_capacity(finalists.len());
        for some in finalists.chunks(at_a_time) {
            let screening: Vec<ScreeningResult> = some.iter().map(|i| racing[*i].clone()).collect();
            let again = self.race(parent, &screening)?;
            fits.extend(self.refit(again)?);
        }
        Ok(fits)
    }

    /// The first steps of the fits that add each of these to a fit.
    fn race(
        &mut self,
        parent: &FittedVariant<'c>,
        screening: &[ScreeningResult],
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        let mut fits = screening
            .iter()
            .map(|result| self.with_candidate(parent, result))
            .collect::<Result<Vec<_>, _>>()?;
        self.cut_short |= !drive_rounds(self.cache, &mut fits, ROUNDS)?;
        Ok(fits)
    }

    /// How many fits with one effect more than `parent` are held at a time; at least one per slot of the fleet, so that no slot
    /// waits.
    fn fits_held(&mut self, parent: &FittedVariant<'c>) -> usize {
        let slots = self.cache.fleet().slots();
        // Two Jacobians, the predictions and the residuals.
        let series = 2 * (parent.jacobian.n_series(&self.cache.rows) + 2);
        (self.cache.series_held() / series).max(slots).max(1)
    }

    /// Positions of the candidates that are refitted after the race, the one with the lowest promised cost first.
    fn finalists(&self, best: &[ScreeningResult], promised: &[f64]) -> Vec<usize> {
        let mut order: Vec<usize> = (0..promised.len()).collect();
        order.sort_by(|a, b| promised[*a].total_cmp(&promised[*b]));
        let first = order.first().map_or(0.0, |i| promised[*i]);
        let scale = (first / self.cache.rows.train.len().max(1) as f64).max(1.0);
        let close = promised.iter().filter(|p| **p <= first + CLOSE * scale).count();
        let keep = if best.len() <= SMALL { SMALL } else { close.clamp(FINAL, FINAL + 2) };
        // The best two scores are refitted even if the race failed by a step too long for its secant approximation.
        let goes_on = |(place, i): &(usize, usize)| *place < keep || *i < SCORED;
        order.into_iter().enumerate().filter(goes_on).map(|(_, i)| i).collect()
    }

    /// Refits until all have converged.
    pub(super) fn refit(
        &mut self,
        mut fits: Vec<FittedVariant<'c>>,
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        self.cut_short |= !drive(self.cache, &mut fits)?;
        for fit in &mut fits {
            fit.polish();
        }
        self.cut_short |= !drive(self.cache, &mut fits)?;
        Ok(fits)
    }

    /// A fit that adds a candidate to a fitted variant, at the amplitude that its score promises.
    pub(super) fn with_candidate(
        &self,
        parent: &FittedVariant<'c>,
        result: &ScreeningResult,
    ) -> Result<FittedVariant<'c>, ExplainError> {
        let unit = result.score.amplitude.abs().max(result.score.sd.min(1e300)).max(f64::MIN_POSITIVE);
        let candidate = &self.candidates[result.candidate];
        let effect = AddedEffect { candidate, index: result.candidate, unit };
        let effects = parent.variant.effects.iter().cloned().chain([effect]).collect();
        let variant = ModelVariant::new(parent.variant.base, effects, &parent.variant.left_out)?;
        let sensitivity = &*result.influence.sensitivity(self.cache)? * unit;
        Ok(FittedVariant::from_parent(variant, parent, &result.point, &sensitivity, &self.cache.rows))
    }

    pub(super) fn judge_all(
        &mut self,
        found: &mut SearchResult<'c>,
        fits: Vec<FittedVariant<'c>>,
    ) -> Result<(), ExplainError> {
        self.cache.stage("gates", &format!("{} refitted", fits.len()));
        for mut fit in fits {
            fit.measure_own_values(self.cache)?;
            let judged = judge(self.cache, &found.base, found.before, fit, found.null_distribution.threshold);
            found.judged.push(judged);
        }
        found.judged.sort_by(order);
        Ok(())
    }

    /// Leaves out every replaceable term in turn and searches for an effect in its place.
    fn replace_terms(&mut self, found: &mut SearchResult<'c>) -> Result<(), ExplainError> {
        let equations = self.cache.study.setup.model.equations.as_ref();
        let terms: Vec<String> = equations.map(|e| e.replaceable.clone()).unwrap_or_default();
        for term in terms {
            let variant = ModelVariant::new(found.base.variant.base, Vec::new(), &[term])?;
            let start = variant.continue_from(&found.base.variant, found.base.z(), &[]);
            let mut without = vec![FittedVariant::begin(variant, start)];
            self.cache.stage("refit", "the model without a replaceable term");
            if !drive(self.cache, &mut without)? {
                self.cut_short = true;
                return Ok(());
            }
            let without = without.swap_remove(0);
            if !without.is_fresh() {
                continue;
            }
            let screening = self.screen_all(&without)?;
            let best = self.best_of_each(&screening);
            let fits = self.race_and_refit(&without, &best)?;
            self.judge_all(found, fits)?;
        }
        Ok(())
    }
}

/// Those that pass the gates first, then by rank.
fn order(a: &JudgedFit<'_>, b: &JudgedFit<'_>) -> Ordering {
    let refused = |j: &JudgedFit<'_>| j.refusal.is_some();
    refused(a).cmp(&refused(b)).then(b.rank().total_cmp(&a.rank()))
}
