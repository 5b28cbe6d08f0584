//! The pass with drift: what is known after an analysis, and how the parameters move on to the next one.
//!
//! A drift belongs between two analyses of a record: what is reported is known before it, and after the last analysis there is none.
//! The pass starts around the annealed estimate, closer than the study's prior; [`FromStart`] puts that prior back at every report.
//! Next file to read: [`super::schedule`].

use nalgebra::DMatrix;
use starlings_estimators::{Analysis, Drift, EstimatorError, Filter, Gaussian, Particles};

use super::runner::AnalysisIndex;
use super::schedule::Schedule;
use crate::posterior;
use crate::store::snapshot::{Ensemble, Snapshot};

/// Particles and predictions that an analysis read.
pub(super) struct Before<'a> {
    pub(super) particles: &'a Particles,
    pub(super) predictions: &'a DMatrix<f64>,
}

/// After the analysis from `before` to `after`: notes what it says, under the study's own prior, and gives the particles that go on
/// to the next one; the transform of the states is that of both.
///
/// # Errors
/// When the drift is out of range or has nothing to start from.
pub(super) fn go_on(
    schedule: &Schedule<'_>,
    filter: &dyn Filter,
    now: &mut Snapshot<Ensemble>,
    before: &Before<'_>,
    after: Particles,
    analysis: &mut Analysis,
) -> Result<Particles, EstimatorError> {
    let used = used(&now.estimate);
    if let Some(from) = &mut now.estimate.from_start {
        let predicted = filter.directions(before.particles, before.predictions);
        from.innovate(&predicted, analysis, &used, &schedule.prior)?;
        from.analysed(filter, before.particles, &analysis.transform, &after);
    }
    let at = AnalysisIndex { pass: now.figures.pass, step: now.figures.step };
    let Some(drift) = schedule.drift(at) else { return Ok(after) };
    let Some(moved) = filter.drift(&after, &drift, analysis.n_used > 0)? else { return Ok(after) };
    if let Some(from) = &mut now.estimate.from_start {
        from.moved(filter, &after, &moved)?;
    }
    analysis.transform *= &moved;
    Ok(Particles { theta: &after.theta * moved, pull: after.pull })
}

/// The prior that a pass started from.
pub(super) fn used(estimate: &Ensemble) -> Gaussian {
    posterior::independent(&estimate.centre, &estimate.scale)
}

impl Schedule<'_> {
    /// The drift after an analysis (pass and step from 0), in the last pass alone: of an entry whose record has no further one it is
    /// none. `None` where nothing drifts.
    fn drift(&self, at: AnalysisIndex) -> Option<Vec<Drift>> {
        if !self.study.drifts() || !self.is_last(at.pass) {
            return None;
        }
        let goes_on = |record: Option<usize>| match record {
            Some(record) => self.windows[record].len() > at.step + 1,
            None => self.n_step() > at.step + 1,
        };
        let drift = self.study.theta.iter().map(|t| if goes_on(t.record) { t.drift } else { Drift::None });
        Some(drift.collect())
    }
}
