//! Runs that begin in the periodic state: each finds its own, with its own parameters, before it goes on.
//!
//! A run that is given no state repeats the first period of its record, from the model's initial state, until the state returns to
//! itself; then it runs as if it had been given that. Nothing is kept between runs, so that the same job gives the same bits wherever it
//! runs. Which steps a window asks for does not enter. Next file to read: [`super`].

use std::sync::Arc;

use super::{NotPeriodic, Periodic, fixed_point, sizes};
use crate::{
    Forward, Job, ModelFailure, ParticleError, Prediction, Setup, SetupError, Spec, Stop, Until, Window,
};

/// Parts of a period at whose ends the sizes of the states are taken.
const PARTS: u32 = 8;

/// What runs jobs, from their periodic state where they are given none.
pub struct PeriodicStart {
    inner: Box<dyn Forward>,
    /// By record.
    periods: Vec<f64>,
    /// Rows of a prediction.
    n_row: usize,
}

/// What runs the jobs of a setup, beginning as it says.
///
/// # Errors
/// When runs shall begin in the periodic state of a model that cannot go on from a state.
pub fn beginning(inner: Box<dyn Forward>, setup: &Setup) -> Result<Box<dyn Forward>, SetupError> {
    if setup.periods.is_empty() {
        return Ok(inner);
    }
    if !inner.spec().restart {
        let message = "a model that cannot go on from a state has no periodic start";
        return Err(SetupError::Invalid(message.to_owned()));
    }
    let size = |name: &String| Spec::range_of(&inner.spec().outputs, name).map_or(1, |range| range.len());
    let n_row = setup.outputs.iter().map(size).sum();
    Ok(Box::new(PeriodicStart { inner, periods: setup.periods.clone(), n_row }))
}

impl PeriodicStart {
    /// The state at the window's start that a period leads back to.
    fn state(&self, job: &Job, period: f64, until: &Until<'_>) -> Result<Vec<f64>, ParticleError> {
        let start = job.window.start;
        let run = |from: f64, to: f64, state: Option<&[f64]>| {
            let window = Arc::new(Window::free(from, vec![to], self.n_row, job.window.inputs.clone()));
            let state = state.map(|x| x.to_vec().into());
            let found = self.inner.run_within(&Job { window, state, ..job.clone() }, until)?;
            Ok(found.state.into_vec())
        };
        let mut states = vec![run(start, start, None)?];
        for part in 1..=PARTS {
            let [from, to] = [part - 1, part].map(|k| start + period * f64::from(k) / f64::from(PARTS));
            let state = run(from, to, states.last().map(Vec::as_slice))?;
            states.push(state);
        }
        let size = sizes(self.inner.spec(), &states);
        let first = states.pop().unwrap_or_default();
        let mut once = |x: &[f64]| run(start, start + period, Some(x));
        match fixed_point(&mut once, first, &size) {
            Ok(Periodic { state, .. }) => Ok(state),
            Err(NotPeriodic::Model(error)) => Err(error),
            Err(NotPeriodic::StillMoving { n_period, change }) => Err(ModelFailure::Solver(format!(
                "no periodic start: after {n_period} periods of {period} the state still changes by {change:.1e} of its size"
            ))
            .into()),
        }
    }
}

impl Forward for PeriodicStart {
    fn spec(&self) -> &Spec {
        self.inner.spec()
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        self.run_within(job, &Until { spent: &|| 0.0, stop: &Stop::default(), traceparent: None })
    }

    fn run_within(&self, job: &Job, until: &Until<'_>) -> Result<Prediction, ParticleError> {
        if job.state.is_some() {
            return self.inner.run_within(job, until);
        }
        let Some(period) = self.periods.get(job.record as usize) else {
            return Err(ParticleError::BadJob(format!("record {} has no period", job.record)));
        };
        let state = Some(self.state(job, *period, until)?.into());
        self.inner.run_within(&Job { state, ..job.clone() }, until)
    }
}
