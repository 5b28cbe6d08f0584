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
const SMALL: usize = 6;
/// Further candidates are refitted when the race promises a cost within this many units of the effective noise of the best.
const CLOSE: f64 = 12.0;

impl<'c> Searcher<'_, '_, 'c> {
    /// Adds single candidates to a fit: a race among the best, then refits of the first few. Where recordings are long, the
    /// race is made with a few at a time, and repeated for those that are refitted; the cache has its runs.
    pub(super) fn race_and_refit(
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
}
