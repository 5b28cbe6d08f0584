//! The search: screen all candidates, refit the best, and start a second pass from the best of these.
//!
//! [`crate::screen::screening`] scores every candidate at the fitted model. The best run a short race, whose first step costs
//! one run each; the first few of it are refitted with every parameter free and judged ([`crate::judge::gates`]). The second
//! pass ([`super::second_pass`]) scores the candidates again at the best variant and tries replacements and pairs. Terms that
//! the study calls replaceable are left out in turn, with an effect in their place ([`super::replacements`]). Next file to read:
//! [`crate::judge::verdict`].

use super::ranking::{largest_of_each, order};
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::drive::drive;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::kind::Kind;
use crate::fit::model_variant::{AddedEffect, ModelVariant};
use crate::judge::adequacy::Adequacy;
use crate::judge::contribution::{check_contributions, leaves_noise};
use crate::judge::effective_noise::inflation;
use crate::judge::gates::{JudgedFit, judge};
use crate::judge::held_out::held_out;
use crate::judge::misfit::Misfit;
use crate::judge::null_distribution::{LEAST, NullDistribution};
use crate::judge::objections::SHARE;
use crate::judge::search_result::SearchResult;
use crate::judge::verdict::{Verdict, decide};
use crate::locate::Track;
use crate::options::Options;
use crate::run_cache::{Course, RunCache};
use crate::screen::screening::screen;
use crate::screen::screening_result::ScreeningResult;

/// What the stages of a search share.
pub(super) struct Searcher<'s, 'l, 'c> {
    pub(super) cache: &'s mut RunCache<'l>,
    pub(super) candidates: &'c [Candidate],
    pub(super) tracks: &'s [Track],
    pub(super) cut_short: bool,
    /// Candidates were asked for by name, so that each is refitted whatever its score says.
    pub(super) asked: bool,
    /// The kinds of effects that are tried.
    pub(super) tried: &'static [Kind],
}

/// Kinds that are tried first, and those that are where effects are asked for by name.
pub(super) const FIRST: &[Kind] = &[Kind::Study, Kind::Library, Kind::Instrument];
pub(super) const ASKED: &[Kind] = &[Kind::Study, Kind::Library, Kind::Generic, Kind::Instrument];

/// The kinds that a search tries first.
pub(crate) fn first_kinds(options: &Options) -> &'static [Kind] {
    if options.only.is_empty() { FIRST } else { ASKED }
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
    let asked = !options.only.is_empty();
    let tried = first_kinds(options);
    let mut searcher = Searcher { cache, candidates, tracks, cut_short: false, asked, tried };
    let before = Misfit::of(searcher.cache, &base);
    let adequacy = Adequacy::of(searcher.cache, &base);
    let held_out = held_out(searcher.cache, &base, &base);
    searcher.cache.foreseen.goes(Course::Screen);
    searcher.cache.stage("screen", &format!("{} candidates", candidates.len()));
    let screening = searcher.screen_all(&base)?;
    let null_distribution = null_distribution(searcher.cache, &base, &screening, candidates)?;
    let largest_gain = largest_gain(&screening, candidates);
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
        looked_at: 1.0,
        cut_short,
    };
    if adequacy.is_gap() || largest_gain > found.null_distribution.threshold {
        let best = searcher.best_of_each(&found.screening);
        searcher.cache.foreseen.goes(Course::Refit);
        searcher.refit_singles(&mut found, &best)?;
        searcher.refit_near_priors(&mut found)?;
        searcher.cache.foreseen.goes(Course::Open);
        searcher.replace_terms(&mut found)?;
        searcher.second_pass(&mut found, options)?;
        if options.max_effects > 1 && searcher.refit_pairs_where_open(&mut found)? {
            searcher.second_pass(&mut found, options)?;
        }
    }
    found.cut_short = searcher.cut_short || searcher.cache.was_cut_short();
    Ok(found)
}

/// Whether two effects would be named that leave more than noise, be it excused: the second was looked for beside the first, and another two
/// that nobody tried together may leave nothing else.
fn is_a_pair_that_leaves_more(found: &SearchResult<'_>) -> bool {
    let passing = found.passing();
    if passing.is_empty() {
        return false;
    }
    let best = &found.judged[check_contributions(found, &passing).best];
    best.fit.variant.effects.len() > 1 && !leaves_noise(best)
}

/// Largest fall of χ² in a screening, to first order, with an amplitude of a sign that physics allows.
fn largest_gain(screening: &[ScreeningResult], candidates: &[Candidate]) -> f64 {
    screening.iter().map(|h| h.allowed_gain(candidates[h.candidate].sign())).fold(0.0, f64::max)
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
    pub(super) fn screen_all(
        &mut self,
        fit: &FittedVariant<'c>,
    ) -> Result<Vec<ScreeningResult>, ExplainError> {
        let of: Vec<(usize, usize)> = self
            .candidates
            .iter()
            .enumerate()
            .filter(|(_, candidate)| self.tried.contains(&candidate.kind))
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
            // Besides the candidates, the model as it is may have to be run once more.
            self.cache.lacks(of.len() + 1);
            self.cut_short = true;
            return Ok(Vec::new());
        }
        let mut results = screen(self.cache, fit, self.candidates, of, self.tracks)?;
        // What takes most of a gap away is judged by what it leaves, and not by the gap.
        let noise = inflation(&self.cache.rows, fit.residual());
        let excess = fit.residual().norm_squared() - fit.residual().len() as f64;
        let least = (LEAST * noise).min(SHARE * excess).max(LEAST);
        for result in &mut results {
            result.is_significant = self.asked || result.score.gain > least;
            result.may_be_imitated = self.asked || self.candidates[result.candidate].moves_own_state();
        }
        Ok(results)
    }

    /// Whether nothing that was refitted would be named. What passes the gates may yet be refused, and stand before a pair that would not be.
    pub(super) fn is_open(&self, found: &SearchResult<'c>) -> Result<bool, ExplainError> {
        Ok(found.passing().is_empty()
            || decide(self.cache, found, self.candidates)?.verdict == Verdict::Unexplained)
    }

    /// Refits pairs where nothing would be named, and others where a pair would be that leaves more than noise: those count only if they leave
    /// nothing else. Says whether it did.
    fn refit_pairs_where_open(&mut self, found: &mut SearchResult<'c>) -> Result<bool, ExplainError> {
        if self.is_open(found)? {
            self.refit_pairs(found)?;
            return Ok(true);
        }
        if !is_a_pair_that_leaves_more(found) {
            return Ok(false);
        }
        let known: Vec<String> = found.judged.iter().map(|j| j.fit.variant.name()).collect();
        self.refit_pairs(found)?;
        found.judged.retain(|j| known.contains(&j.fit.variant.name()) || leaves_noise(j));
        Ok(true)
    }

    /// Takes the scores of further candidates into a search, whose chance is then that of all of them.
    pub(super) fn widen(
        &self,
        found: &mut SearchResult<'c>,
        screening: Vec<ScreeningResult>,
    ) -> Result<(), ExplainError> {
        found.screening.extend(screening);
        found.null_distribution =
            null_distribution(self.cache, &found.base, &found.screening, self.candidates)?;
        // The largest of k times as many squares of normal numbers is 2 ln k larger (Fisher and Tippett 1928).
        found.null_distribution.threshold += 2.0 * found.looked_at.ln();
        found.largest_gain = largest_gain(&found.screening, self.candidates);
        Ok(())
    }

    /// Refits the best of these candidates, one effect each, and goes on down the list while none of them passes the gates and the next still
    /// gains more than chance.
    pub(super) fn refit_singles(
        &mut self,
        found: &mut SearchResult<'c>,
        best: &[ScreeningResult],
    ) -> Result<(), ExplainError> {
        let chance = found.adequacy.inflation * found.null_distribution.threshold;
        let mut next = best.to_vec();
        while !next.is_empty() {
            let fits = self.race_and_refit(&found.base, &next, &found.screening)?;
            if fits.is_empty() || self.cut_short {
                return self.judge_all(found, fits);
            }
            self.judge_all(found, fits)?;
            let is_refitted = |h: &ScreeningResult| {
                found.judged.iter().any(|j| j.fit.variant.effects[0].index == h.candidate)
            };
            next.clear();
            // What passed in an earlier search and was refused by the verdict does not end this one.
            let is_tried = |j: &JudgedFit<'_>| j.kinds().iter().all(|kind| self.tried.contains(kind));
            if !found.judged.iter().any(|j| j.refusal.is_none() && is_tried(j)) {
                next.extend(best.iter().filter(|h| h.score.gain > chance && !is_refitted(h)).cloned());
            }
        }
        Ok(())
    }

    /// The best point of the grid of every candidate that could be named, largest gain first.
    pub(super) fn best_of_each(&self, screening: &[ScreeningResult]) -> Vec<ScreeningResult> {
        let gain = |h: &ScreeningResult| h.allowed_gain(self.candidates[h.candidate].sign());
        let usable = screening.iter().filter(|h| h.failure.is_none() && !h.is_absorbed() && gain(h) > 0.0);
        largest_of_each(usable, gain)
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
        self.settle_instants(&mut fits)?;
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
}
