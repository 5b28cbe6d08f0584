//! What the particles of an analysis are given, rebuilt from an earlier analysis whose inputs are known.
//!
//! The analyses between the two are made again with all their particles, so the inputs have the bits of the first time where the
//! runs in between do. Next file to read: [`crate::replay`].

use std::ops::ControlFlow;

use nalgebra::DMatrix;
use starlings_estimators::{Form, Kind};

use super::filter;
use super::runner::EnsembleRunner;
use super::runner::StepWindows;
use super::schedule::Schedule;
use crate::states::States;
use crate::store::snapshot::{Ensemble, Figures, Snapshot};
use crate::store::{Inputs, JobRow, StoreError};
use crate::{RunError, Study};

/// What the particles of an analysis are given.
pub(crate) struct Given {
    /// Transformed parameters, p × r.
    pub(crate) theta: DMatrix<f64>,
    /// States by record.
    pub(crate) states: Vec<Option<States>>,
    /// The windows, by record.
    pub(crate) windows: StepWindows,
}

/// What the particles of analysis `to` are given, from the `inputs` of an earlier one of its pass. `check` sees the runs of every
/// analysis that is made again and may end it; then there is nothing.
///
/// # Errors
/// When the fleet or the estimator fails.
pub(crate) fn rebuild(
    kind: &Kind,
    runner: &mut EnsembleRunner<'_>,
    inputs: Inputs,
    to: usize,
    check: &mut dyn FnMut(&[JobRow]) -> ControlFlow<()>,
) -> Result<Option<Given>, RunError> {
    let study = runner.study();
    let Form::Windows(make) = kind.form else {
        let states = vec![None; study.records.len()];
        return Ok(Some(Given { theta: inputs.theta, states, windows: study.trained_windows() }));
    };
    let schedule = Schedule::new(study, make)?;
    let mut now = restored(study, inputs)?;
    let mut reported = schedule.reported(&now)?;
    while now.figures.step < to {
        let (row, next) = filter::step(runner, &schedule, &mut now, &reported)?;
        reported = next;
        if check(&row.jobs).is_break() {
            return Ok(None);
        }
    }
    let windows = schedule.step_windows(to);
    Ok(Some(Given { theta: now.estimate.theta.to_dense(), states: now.states, windows }))
}

/// The filter as it stood before an analysis; figures that no run depends on are zero.
fn restored(study: &Study, inputs: Inputs) -> Result<Snapshot<Ensemble>, RunError> {
    let Inputs { pass, step, theta, start, states } = inputs;
    let fits =
        |start: &DMatrix<f64>| start.shape() == (study.theta.len(), 2) && theta.nrows() == study.theta.len();
    let Some(start) = start.filter(fits) else {
        let text = "the inputs in the store are not those of a filter with the parameters of this study";
        return Err(StoreError::Unusable(text.to_owned()).into());
    };
    let column = |index| start.column(index).iter().copied().collect();
    let estimate = Ensemble {
        theta: (&theta).into(),
        centre: column(0),
        scale: column(1),
        cost: None,
        narrow: 1.0,
        from_start: None,
    };
    let figures = Figures { pass: pass - 1, step, ..Figures::default() };
    Ok(Snapshot { figures, estimate, states: states.into_iter().map(|x| x.map(States::from)).collect() })
}
