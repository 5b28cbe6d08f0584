//! How passes go on until the estimate has settled: where the next one starts, and when there is no next one.
//!
//! A tight pass proposes a step of Gauss and Newton. Its full length is taken where that does not raise the cost, the squared
//! misfit of a run at the point plus its squared distance from the prior; otherwise the best of ever shorter ones (step
//! halving: Nocedal & Wright 2006, section 3.1, with the decrease tested by runs of whole records). So the cost falls from pass
//! to pass, and the passes end at the most probable value, as the batch fit does. Where no length lowers it, the points are
//! drawn together and the pass is repeated. No state is kept that a snapshot would have to hold beside the ensemble: a resume
//! repeats the decision between two passes. Next file to read: [`super::filter`].

use nalgebra::DMatrix;

use super::runner::{AnalysisIndex, EnsembleRunner, Predicted, StepWindows};
use super::schedule::{Reported, Schedule};
use crate::store::snapshot::{Ensemble, Snapshot};
use crate::{Move, RunError, posterior};

/// Passes at most.
pub const LIMIT: usize = 12;
/// Lengths of the step that are tried where its full length raises the cost.
const SHORTER: [f64; 5] = [0.5, 0.25, 0.125, 0.0625, 0.015_625];
/// A rise of the cost that a move of so many posterior sd, which counts as settled, could make.
const LEVEL: f64 = Move::SETTLED * Move::SETTLED;
/// Factor on the width of the points where no step lowers the cost.
const NARROWER: f64 = 0.1;
/// The points are drawn together no further than this.
const NARROWEST: f64 = 0.01;

/// The ensemble of the next pass; `None` when there is none.
///
/// # Errors
/// When the fleet fails.
pub(super) fn next(
    runner: &mut EnsembleRunner<'_>,
    schedule: &Schedule<'_>,
    now: &Snapshot<Ensemble>,
    reported: &Reported,
) -> Result<Option<Snapshot<Ensemble>>, RunError> {
    if schedule.passes.is_some() {
        let more = !schedule.is_last(now.figures.pass);
        return Ok(more.then(|| schedule.start(now.figures.pass + 1, &reported.posterior)));
    }
    let settled = schedule.last_move(now, reported).is_some_and(|m| m.is_settled());
    if settled || now.figures.pass + 1 == LIMIT {
        return Ok(None);
    }
    let search = Search::new(schedule, now, reported);
    let Some(found) = search.run(runner)? else {
        let narrow = now.estimate.narrow * NARROWER;
        if narrow < NARROWEST {
            return Ok(None);
        }
        let mut repeated =
            schedule.start_at(now.figures.pass + 1, &reported.posterior, now.estimate.centre.clone(), narrow);
        repeated.estimate.cost = now.estimate.cost;
        return Ok(Some(repeated));
    };
    let mut next =
        schedule.start_at(now.figures.pass + 1, &reported.posterior, found.point, now.estimate.narrow);
    next.estimate.cost = found.cost.is_finite().then_some(found.cost);
    Ok(Some(next))
}

/// A point and its cost; infinite where the model fails.
struct Point {
    point: Vec<f64>,
    cost: f64,
}

/// The line from the centre of a pass to the point that it found.
struct Search<'a> {
    schedule: &'a Schedule<'a>,
    now: &'a Snapshot<Ensemble>,
    found: Vec<f64>,
    windows: StepWindows,
}

impl<'a> Search<'a> {
    fn new(schedule: &'a Schedule<'a>, now: &'a Snapshot<Ensemble>, reported: &Reported) -> Self {
        let study = schedule.study;
        Self {
            schedule,
            now,
            found: reported.posterior.mean.iter().copied().collect(),
            windows: study.trained_windows(),
        }
    }

    /// The longest step that does not raise the cost, or of the shorter ones the best; `None` when all raise it.
    ///
    /// In a first pass, where no part of the step is better than the prior median, the prior median is the next centre.
    fn run(&self, runner: &mut EnsembleRunner<'_>) -> Result<Option<Point>, RunError> {
        let first = self.now.figures.pass == 0;
        let start = self.now.estimate.cost;
        let lengths: &[f64] = if start.is_some() { &[1.0] } else { &[1.0, 0.0] };
        let mut points = self.points(runner, lengths)?;
        let unmoved = if start.is_none() { points.pop() } else { None };
        let level = start.or(unmoved.as_ref().map(|p| p.cost)).unwrap_or(f64::INFINITY);
        let Some(full) = points.pop().filter(|p| p.cost <= level + LEVEL) else {
            let shorter = self.points(runner, &SHORTER)?;
            let best =
                shorter.into_iter().filter(|p| p.cost < level).min_by(|a, b| a.cost.total_cmp(&b.cost));
            return Ok(best.or(unmoved.filter(|_| first)));
        };
        Ok(Some(full))
    }

    /// Runs every trained record at these shares of the step.
    fn points(&self, runner: &mut EnsembleRunner<'_>, lengths: &[f64]) -> Result<Vec<Point>, RunError> {
        let from = &self.now.estimate.centre;
        let theta = DMatrix::from_fn(from.len(), lengths.len(), |j, k| {
            // The whole step ends exactly at the point that was found.
            if lengths[k] >= 1.0 { self.found[j] } else { from[j] + lengths[k] * (self.found[j] - from[j]) }
        });
        let at = AnalysisIndex { pass: self.now.figures.pass + 1, step: self.now.figures.step };
        let results = runner.run_from_start(at, &theta, &self.windows)?;
        let prior = posterior::prior(self.schedule.study);
        let point = |(k, of_point): (usize, &Vec<Result<_, _>>)| {
            let at = theta.column(k);
            let far =
                (at - &prior.mean).component_div(&prior.covariance.diagonal().map(f64::sqrt)).norm_squared();
            Point { point: at.iter().copied().collect(), cost: far + self.misfit(of_point) }
        };
        Ok(results.iter().enumerate().map(point).collect())
    }

    /// Squared whitened misfit of one point over all records; infinite where a run failed.
    fn misfit(&self, of_point: &[Predicted]) -> f64 {
        let mut sum = 0.0;
        for ((record, window), result) in self.windows.iter().zip(of_point) {
            let Ok(prediction) = result else { return f64::INFINITY };
            let noise = self.schedule.study.noise(*record);
            let rows = window.observed.iter().zip(&prediction.outputs).enumerate();
            let squares = rows
                .filter(|(_, (z, _))| z.is_finite())
                .map(|(i, (z, y))| ((z - y) / noise[i % noise.len()]).powi(2));
            sum += squares.sum::<f64>();
        }
        if sum.is_finite() { sum } else { f64::INFINITY }
    }
}
