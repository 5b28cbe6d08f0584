//! The race: the best candidates take their first steps, those that promise most are refitted with every parameter free.
//!
//! Next file to read: [`super::search`].

use super::search::Searcher;
use crate::error::ExplainError;
use crate::fit::drive::drive_rounds;
use crate::fit::fitted_variant::FittedVariant;
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
pub(super) const SMALL: usize = 6;
/// Further candidates are refitted when the race promises a cost within this many units of the effective noise of the best.
const CLOSE: f64 = 12.0;

/// Points of the grid at which one candidate begins the race ...
const STARTS: usize = 3;
/// ... those beside the best whose score gains this share of the best one's.
const FLAT: f64 = 0.5;
/// Parameters of a fit up to which a second start is refitted as well, where the race cannot tell it from the best.
const CHEAP: usize = 12;

/// A candidate at one point of its grid.
struct Start {
    /// Position of the candidate among those that race.
    of: usize,
    from: ScreeningResult,
}

impl<'c> Searcher<'_, '_, 'c> {
    /// Adds single candidates to a fit: a race among the best, then refits of the first few. A candidate whose score hardly depends on
    /// the parameters inside its term, or has several peaks, begins at several points of its grid; the best of its fits counts. Where
    /// recordings are long, the race is made with a few at a time, and repeated for those that are refitted; the cache has its runs.
    pub(super) fn race_and_refit(
        &mut self,
        parent: &FittedVariant<'c>,
        best: &[ScreeningResult],
        screening: &[ScreeningResult],
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        self.cache.stage("refit", "a race among the best candidates");
        let racing: Vec<Start> = best
            .iter()
            .take(RACE)
            .enumerate()
            .flat_map(|(of, best)| {
                self.starts(best, screening).into_iter().map(move |from| Start { of, from })
            })
            .collect();
        let at_a_time = self.fits_held(parent);
        let (mut raced, mut promised) = (Vec::new(), Vec::new());
        for some in racing.chunks(at_a_time) {
            raced.clear();
            raced.extend(self.race(parent, some)?.into_iter().map(Some));
            promised.extend(raced.iter().flatten().map(FittedVariant::promised));
        }
        let is_cheap = parent.variant.n_param() < CHEAP;
        let finalists = self.finalists(best, &racing, &promised, is_cheap);
        self.cache.stage("refit", &format!("{} candidates with every parameter free", finalists.len()));
        let mut fits = Vec::with_capacity(finalists.len());
        if racing.len() <= at_a_time {
            fits = self.refit(finalists.into_iter().filter_map(|i| raced[i].take()).collect())?;
        } else {
            drop(raced);
            for some in finalists.chunks(at_a_time) {
                let again: Vec<Start> =
                    some.iter().map(|i| Start { of: 0, from: racing[*i].from.clone() }).collect();
                let again = self.race(parent, &again)?;
                fits.extend(self.refit(again)?);
            }
        }
        Ok(best_of_each(fits))
    }

    /// The best point of a candidate's grid, and others whose scores come near.
    fn starts(&self, best: &ScreeningResult, screening: &[ScreeningResult]) -> Vec<ScreeningResult> {
        let gain = |h: &ScreeningResult| h.allowed_gain(self.candidates[h.candidate].sign());
        let is_near = |h: &&ScreeningResult| {
            h.candidate == best.candidate
                && h.point != best.point
                && h.failure.is_none()
                && !h.is_absorbed()
                && gain(h) > FLAT * gain(best)
        };
        let mut others: Vec<&ScreeningResult> = screening.iter().filter(is_near).collect();
        others.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
        std::iter::once(best).chain(others).take(STARTS).cloned().collect()
    }

    /// The first steps of the fits that add each of these to a fit.
    fn race(
        &mut self,
        parent: &FittedVariant<'c>,
        starts: &[Start],
    ) -> Result<Vec<FittedVariant<'c>>, ExplainError> {
        let mut fits = starts
            .iter()
            .map(|start| self.with_candidate(parent, &start.from))
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

    /// Positions of the starts that are refitted after the race, the one with the lowest promised cost first: one of each candidate
    /// that goes on, two where the fit is cheap and the second promises about as much.
    fn finalists(
        &self,
        best: &[ScreeningResult],
        racing: &[Start],
        promised: &[f64],
        is_cheap: bool,
    ) -> Vec<usize> {
        let mut order: Vec<usize> = (0..promised.len()).collect();
        order.sort_by(|a, b| promised[*a].total_cmp(&promised[*b]));
        let first = order.first().map_or(0.0, |i| promised[*i]);
        let scale = (first / self.cache.rows.train.len().max(1) as f64).max(1.0);
        let mut leading: Vec<usize> = Vec::new();
        for i in &order {
            if !leading.iter().any(|known| racing[*known].of == racing[*i].of) {
                leading.push(*i);
            }
        }
        let close = leading.iter().filter(|i| promised[**i] <= first + CLOSE * scale).count();
        let keep = if best.len() <= SMALL { SMALL } else { close.clamp(FINAL, FINAL + 2) };
        // The best two scores are refitted even if the race failed by a step too long for its secant approximation.
        let goes_on = |(place, i): &(usize, usize)| *place < keep || racing[*i].of < SCORED;
        let kept: Vec<usize> = leading.into_iter().enumerate().filter(goes_on).map(|(_, i)| i).collect();
        let is_second = |i: &usize, of: &usize| {
            i != of && racing[*i].of == racing[*of].of && promised[*i] <= promised[*of] + CLOSE * scale
        };
        let with_second = |of: usize| {
            let second = order.iter().copied().find(|i| is_cheap && is_second(i, &of));
            std::iter::once(of).chain(second)
        };
        kept.into_iter().flat_map(with_second).collect()
    }
}

/// The fit of lowest cost of every candidate, in the order in which they come first.
fn best_of_each(fits: Vec<FittedVariant<'_>>) -> Vec<FittedVariant<'_>> {
    let mut best: Vec<FittedVariant<'_>> = Vec::with_capacity(fits.len());
    let last = |fit: &FittedVariant<'_>| fit.variant.effects.last().map(|effect| effect.index);
    for fit in fits {
        match best.iter_mut().find(|known| last(known) == last(&fit)) {
            Some(known) if fit.cost() < known.cost() => *known = fit,
            Some(_) => {}
            None => best.push(fit),
        }
    }
    best
}
