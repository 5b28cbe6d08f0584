//! The search: screen all candidates, refit the best, look again from there, add, replace, and pair.
//!
//! The path of one explanation: [`super::screen`] scores every candidate at the fitted model; the best run a short race whose
//! first step costs one run each; the last few are refitted with every parameter free and [`super::judge`]d. From the best the
//! candidates are scored again, which shows whether something is left and which replacement or pair to try. Terms that the
//! study calls replaceable are left out in turn and the same is done without them. Next file to read: [`super::verdict`].

use std::cmp::Ordering;

use super::adequacy::Adequacy;
use super::background::Background;
use super::candidate::Candidate;
use super::fit::{Fitted, drive, drive_rounds};
use super::held_out::{HeldOut, held_out};
use super::judge::{Judged, judge};
use super::laboratory::Laboratory;
use super::locate::Track;
use super::misfit::Misfit;
use super::screen::{Hit, screen};
use super::version::{Member, Version};
use super::{ExplainError, Options};

/// Candidates that run the race.
const RACE: usize = 8;
/// Rounds of the race.
const ROUNDS: usize = 2;
/// Candidates that are refitted after it.
const FINAL: usize = 3;
/// Of the best scores, so many are refitted whatever the race says.
const SCORED: usize = 2;
/// Libraries of at most so many candidates are refitted whole: a large misfit can mislead a linear score.
const SMALL: usize = 6;
/// Further candidates are refitted when the race promises a cost within this many units of the effective noise of the best.
const CLOSE: f64 = 12.0;

/// Everything that the search found.
pub(crate) struct Found<'c> {
    /// The model as it is.
    pub base: Fitted<'c>,
    /// Its misfit.
    pub before: Misfit,
    /// Its training residuals against the stated noise.
    pub adequacy: Adequacy,
    /// What the data say of it that no fit has seen.
    pub held_out: Vec<HeldOut>,
    /// What chance would give.
    pub background: Background,
    /// The screening at the model as it is, every candidate and grid point.
    pub hits: Vec<Hit>,
    /// Largest fall of χ² in it, to first order, with an amplitude of a sign that physics allows.
    pub alarm: f64,
    /// Every version that was refitted, the best first.
    pub judged: Vec<Judged<'c>>,
    /// Whether the budget cut the search short.
    pub cut_short: bool,
}

impl Found<'_> {
    /// Positions of the versions that pass every gate, the best first.
    pub(super) fn passing(&self) -> Vec<usize> {
        (0..self.judged.len()).filter(|i| self.judged[*i].refusal.is_none()).collect()
    }
}

/// What the stages of a search share.
pub(super) struct Searcher<'s, 'l, 'c> {
    pub(super) laboratory: &'s mut Laboratory<'l>,
    pub(super) candidates: &'c [Candidate],
    pub(super) tracks: &'s [Track],
    pub(super) cut_short: bool,
}

/// Searches from a fitted model.
///
/// # Errors
/// When the fleet or the store fails, or the fit leaves a direction free.
pub(crate) fn search<'c>(
    laboratory: &mut Laboratory<'_>,
    base: Fitted<'c>,
    candidates: &'c [Candidate],
    tracks: &[Track],
    options: &Options,
) -> Result<Found<'c>, ExplainError> {
    let mut searcher = Searcher { laboratory, candidates, tracks, cut_short: false };
    let before = Misfit::of(searcher.laboratory, &base);
    let adequacy = Adequacy::of(searcher.laboratory, &base);
    let held_out = held_out(searcher.laboratory, &base, &base);
    searcher.laboratory.stage("screen", &format!("{} candidates", candidates.len()));
    let hits = searcher.screen_all(&base)?;
    let background = background(searcher.laboratory, &base, &hits, candidates)?;
    let alarm = hits.iter().map(|h| h.allowed_gain(candidates[h.candidate].sign())).fold(0.0, f64::max);
    let (judged, cut_short) = (Vec::new(), false);
    let mut found = Found { base, before, adequacy, held_out, background, hits, alarm, judged, cut_short };
    if adequacy.is_gap() || alarm > found.background.threshold {
        searcher.singles(&mut found)?;
        searcher.replacements(&mut found)?;
        searcher.look_again(&mut found, options)?;
    }
    found.cut_short = searcher.cut_short || searcher.laboratory.was_cut_short();
    Ok(found)
}

/// What chance would give at a fit.
fn background(
    laboratory: &Laboratory<'_>,
    fit: &Fitted<'_>,
    hits: &[Hit],
    candidates: &[Candidate],
) -> Result<Background, ExplainError> {
    let (rows, seed) = (&laboratory.rows, laboratory.study.seed);
    let at_a_time = laboratory.series_held();
    let of_train = |hit: &Hit| hit.influence.of_train(laboratory);
    Background::new(&fit.optimum()?, rows, hits, candidates, seed, at_a_time, &of_train)
}

impl<'c> Searcher<'_, '_, 'c> {
    fn screen_all(&mut self, fit: &Fitted<'c>) -> Result<Vec<Hit>, ExplainError> {
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
        fit: &Fitted<'c>,
        of: &[(usize, usize)],
    ) -> Result<Vec<Hit>, ExplainError> {
        if !self.laboratory.affords(of.len()) {
            self.cut_short = true;
            return Ok(Vec::new());
        }
        screen(self.laboratory, fit, self.candidates, of, self.tracks)
    }

    /// Refits the best candidates alone.
    fn singles(&mut self, found: &mut Found<'c>) -> Result<(), ExplainError> {
        let best = self.best_of_each(&found.hits);
        let fits = self.explore(&found.base, &best)?;
        self.judge_all(found, fits)
    }

    /// The best point of the grid of every candidate that could be named, largest gain first.
    pub(super) fn best_of_each(&self, hits: &[Hit]) -> Vec<Hit> {
        let gain = |h: &Hit| h.allowed_gain(self.candidates[h.candidate].sign());
        let mut best: Vec<Hit> = Vec::new();
        for hit in hits.iter().filter(|h| h.failure.is_none() && !h.is_absorbed() && gain(h) > 0.0) {
            match best.iter_mut().find(|b| b.candidate == hit.candidate) {
                Some(known) if gain(hit) > gain(known) => known.clone_from(hit),
                Some(_) => {}
                None => best.push(hit.clone()),
            }
        }
        best.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
        best
    }

    /// Adds single candidates to a fit: a race among the best, then refits of the last few. Where recordings are long, a few are
    /// held at a time, and those that go on are raced again, which takes no run.
    fn explore(&mut self, parent: &Fitted<'c>, best: &[Hit]) -> Result<Vec<Fitted<'c>>, ExplainError> {
        self.laboratory.stage("refit", "a race among the best candidates");
        let racing = &best[..best.len().min(RACE)];
        let at_a_time = self.fits_held(parent);
        let (mut raced, mut promised) = (Vec::new(), Vec::new());
        for some in racing.chunks(at_a_time) {
            raced.clear();
            raced.extend(self.race(parent, some)?.into_iter().map(Some));
            promised.extend(raced.iter().flatten().map(Fitted::promised));
        }
        let kept = self.kept(best, &promised);
        self.laboratory.stage("refit", &format!("{} candidates with every parameter free", kept.len()));
        if racing.len() <= at_a_time {
            return self.refit(kept.into_iter().filter_map(|i| raced[i].take()).collect());
        }
        drop(raced);
        let mut fits = Vec::with_capacity(kept.len());
        for some in kept.chunks(at_a_time) {
            let hits: Vec<Hit> = some.iter().map(|i| racing[*i].clone()).collect();
            let again = self.race(parent, &hits)?;
            fits.extend(self.refit(again)?);
        }
        Ok(fits)
    }

    /// A few steps of the fits that add each of these to a fit.
    fn race(&mut self, parent: &Fitted<'c>, hits: &[Hit]) -> Result<Vec<Fitted<'c>>, ExplainError> {
        let mut fits = hits.iter().map(|hit| self.with(parent, hit)).collect::<Result<Vec<_>, _>>()?;
        self.cut_short |= !drive_rounds(self.laboratory, &mut fits, ROUNDS)?;
        Ok(fits)
    }

    /// Fits with one effect more than `parent` that are held at a time, at least one for each slot of the fleet: with fewer it waits.
    fn fits_held(&mut self, parent: &Fitted<'c>) -> usize {
        let slots = self.laboratory.fleet().slots();
        // Two Jacobians, the predictions and the residuals.
        let series = 2 * (parent.jacobian.n_series(&self.laboratory.rows) + 2);
        (self.laboratory.series_held() / series).max(slots).max(1)
    }

    /// Positions of the best that go on after a race, the one that promises most first.
    fn kept(&self, best: &[Hit], promised: &[f64]) -> Vec<usize> {
        let mut order: Vec<usize> = (0..promised.len()).collect();
        order.sort_by(|a, b| promised[*a].total_cmp(&promised[*b]));
        let first = order.first().map_or(0.0, |i| promised[*i]);
        let scale = (first / self.laboratory.rows.train.len().max(1) as f64).max(1.0);
        let close = promised.iter().filter(|p| **p <= first + CLOSE * scale).count();
        let keep = if best.len() <= SMALL { SMALL } else { close.clamp(FINAL, FINAL + 2) };
        // A step too long for the secant must not cost the best two scores their refit.
        let goes_on = |(place, i): &(usize, usize)| *place < keep || *i < SCORED;
        order.into_iter().enumerate().filter(goes_on).map(|(_, i)| i).collect()
    }

    /// Refits until all have converged.
    pub(super) fn refit(&mut self, mut fits: Vec<Fitted<'c>>) -> Result<Vec<Fitted<'c>>, ExplainError> {
        self.cut_short |= !drive(self.laboratory, &mut fits)?;
        for fit in &mut fits {
            fit.polish();
        }
        self.cut_short |= !drive(self.laboratory, &mut fits)?;
        Ok(fits)
    }

    /// A fit that adds a candidate to a fitted version, at the amplitude that its score promises.
    pub(super) fn with(&self, parent: &Fitted<'c>, hit: &Hit) -> Result<Fitted<'c>, ExplainError> {
        let unit = hit.score.amplitude.abs().max(hit.score.sd.min(1e300)).max(f64::MIN_POSITIVE);
        let candidate = &self.candidates[hit.candidate];
        let member = Member { candidate, index: hit.candidate, unit };
        let members = parent.version.members.iter().cloned().chain([member]).collect();
        let version = Version::new(parent.version.base, members, &parent.version.left_out)?;
        let sensitivity = &*hit.influence.sensitivity(self.laboratory)? * unit;
        Ok(Fitted::from_parent(version, parent, &hit.point, &sensitivity, &self.laboratory.rows))
    }

    pub(super) fn judge_all(
        &mut self,
        found: &mut Found<'c>,
        fits: Vec<Fitted<'c>>,
    ) -> Result<(), ExplainError> {
        self.laboratory.stage("gates", &format!("{} refitted", fits.len()));
        for mut fit in fits {
            fit.measure_own_values(self.laboratory)?;
            let judged = judge(self.laboratory, &found.base, found.before, fit, found.background.threshold);
            found.judged.push(judged);
        }
        found.judged.sort_by(order);
        Ok(())
    }

    /// Leaves out every replaceable term in turn and searches for what replaces it.
    fn replacements(&mut self, found: &mut Found<'c>) -> Result<(), ExplainError> {
        let equations = self.laboratory.study.setup.model.equations.as_ref();
        let terms: Vec<String> = equations.map(|e| e.replaceable.clone()).unwrap_or_default();
        for term in terms {
            let version = Version::new(found.base.version.base, Vec::new(), &[term])?;
            let start = version.continue_from(&found.base.version, found.base.z(), &[]);
            let mut without = vec![Fitted::begin(version, start)];
            self.laboratory.stage("refit", "the model without a replaceable term");
            if !drive(self.laboratory, &mut without)? {
                self.cut_short = true;
                return Ok(());
            }
            let without = without.swap_remove(0);
            if !without.is_fresh() {
                continue;
            }
            let hits = self.screen_all(&without)?;
            let best = self.best_of_each(&hits);
            let fits = self.explore(&without, &best)?;
            self.judge_all(found, fits)?;
        }
        Ok(())
    }
}

/// Those that pass the gates first, then by rank.
fn order(a: &Judged<'_>, b: &Judged<'_>) -> Ordering {
    let refused = |j: &Judged<'_>| j.refusal.is_some();
    refused(a).cmp(&refused(b)).then(b.rank().total_cmp(&a.rank()))
}
