//! The runs of a fit, made once at the prior median before it begins: the same windows, spans and adapters.
//!
//! The filter's windows run one after the other from the state in which the one before ended; the batch fit runs the training
//! span. A program that is started anew for every run and answers for the times of a whole record only, whatever it was asked,
//! is supported: the study then runs whole records and takes the rows that train. Next file to read: [`crate::plan`].

use std::sync::Arc;

use starlings_estimators::{Form, Kind};
use starlings_fleet::Held;
use starlings_models::external::table::is_transposed;
use starlings_models::{Prediction, Window};

use super::{Fault, Here, Runner, TrialChannel, TrialError, asked, named, rounding, run, trial_by};
use crate::predicted::members::setup_of;
use crate::{Study, posterior};

/// Windows of a record that are run where not all are.
const FIRST: usize = 3;

/// How many of the filter's windows are run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// All, as in one pass for one particle.
    All,
    /// The first of every record: before a run, which makes the others later.
    First,
}

/// The trial of [`super::trial()`] and then the runs of a fit by `kind`; notes in the study whether whole records must be run. None
/// where the model cannot be run in this process.
///
/// # Errors
/// As [`super::trial()`], and when a run of the fit or of what is predicted fails though the whole record does not.
pub fn dry_run(study: &mut Study, kind: &Kind, depth: Depth) -> Result<Vec<TrialChannel>, TrialError> {
    if !study.runs_here {
        return Ok(Vec::new());
    }
    let model = study.solver_host.build(&study.setup)?;
    let channels = dry_run_by(study, kind, depth, &Here(&*model))?;
    if asked::is_more(study) {
        asked::predictions(study, depth, &Here(&*study.solver_host.build(&setup_of(study))?))?;
    }
    if kind.has_exact_slopes() {
        let sensitive = study.solver_host.build(&study.with_slopes())?;
        for record in (0..study.records.len()).filter(|record| study.records[*record].is_trained()) {
            DryRun::new(study, &Here(&*sensitive), record).with_slopes()?;
        }
    }
    Ok(channels)
}

/// The same by whoever makes the runs.
pub(super) fn dry_run_by(
    study: &mut Study,
    kind: &Kind,
    depth: Depth,
    model: &dyn Runner,
) -> Result<Vec<TrialChannel>, TrialError> {
    let channels = trial_by(study, model)?;
    for record in 0..study.records.len() {
        if !study.records[record].is_trained() {
            continue;
        }
        let of_record = DryRun::new(study, model, record);
        let told = match kind.form {
            Form::Windows(_) => of_record.windows(depth).map(|()| None)?,
            Form::WholeRecords(_) => of_record.training_span()?,
        };
        if let Some(why) = told.filter(|_| !study.whole_answers) {
            study.whole_answers = true;
            // The folder of the run is left out: this answer is accepted.
            let why = why.split("; the folder of the run").next().unwrap_or_default();
            study.warnings.push(format!(
                "the solver answers for the times of a whole record, not for the training span alone: every run of the fit covers \
                 whole records, of which it takes the rows that train. Asked for less: {why}"
            ));
        }
    }
    if channels.iter().any(|channel| channel.looks_rounded) {
        rounding::heed(study, model);
    }
    Ok(channels)
}

/// The runs of one record.
struct DryRun<'a> {
    study: &'a Study,
    model: &'a dyn Runner,
    record: usize,
    theta: Vec<f64>,
}

impl<'a> DryRun<'a> {
    fn new(study: &'a Study, model: &'a dyn Runner, record: usize) -> Self {
        let prior = posterior::prior(study);
        Self { study, model, record, theta: study.theta_for(record, prior.mean.as_slice()) }
    }

    fn name(&self) -> String {
        self.study.records[self.record].name.clone()
    }

    fn run(&self, window: &Arc<Window>, state: Option<Held>) -> Result<Prediction<Held>, Fault> {
        let sent = self.study.sendable(self.record, window);
        run(self.model, self.record, &sent, &self.theta, state)
    }

    fn failed(&self, fault: Fault, span: String) -> TrialError {
        let record = self.name();
        match fault {
            Fault::Run(source) => {
                TrialError::Fit { record, span, values: named(self.study, &self.theta), source }
            }
            Fault::Travel(source) => TrialError::Travel { record, source },
        }
    }

    /// The filter's windows, each from the end of the one before.
    fn windows(&self, depth: Depth) -> Result<(), TrialError> {
        let most = if depth == Depth::First { FIRST } else { usize::MAX };
        let mut state = None;
        for window in self.study.windows(self.record).into_iter().take(most) {
            let span = || format!("in the window from {} to {}", window.start, end(&window));
            let prediction = self.run(&window, state).map_err(|fault| self.failed(fault, span()))?;
            state = Some(prediction.state);
        }
        Ok(())
    }

    /// The training span with its slopes, which take more steps than the outputs alone.
    fn with_slopes(&self) -> Result<(), TrialError> {
        let window = self.study.widened(&self.study.whole(self.record, true));
        let span = || format!("with its slopes, from {} to {}", window.start, end(&window));
        run(self.model, self.record, &window, &self.theta, None)
            .map_err(|fault| self.failed(fault, span()))?;
        Ok(())
    }

    /// The training span; why it fails where the whole record is to be run instead.
    fn training_span(&self) -> Result<Option<String>, TrialError> {
        let window = Arc::new(self.study.whole(self.record, true));
        let is_part = window.times.len() < self.study.records[self.record].times.len();
        let solver = self.study.setup.model.solver.as_ref();
        // A solver that does not describe itself cannot say which times it answers for.
        let unasked = solver.map(|s| {
            self.study.solver_host.adapter(&s.adapter).is_some_and(|adapter| !adapter.describes_itself)
        });
        let prediction = match self.run(&window, None) {
            Ok(prediction) => prediction,
            Err(Fault::Run(source)) if is_part && unasked == Some(true) => {
                return Ok(Some(source.to_string()));
            }
            Err(fault) => {
                let n = window.times.len();
                let span =
                    format!("over its training span, {n} times from {} to {}", window.start, end(&window));
                return Err(self.failed(fault, span));
            }
        };
        if unasked == Some(false) {
            self.check_layout(&window, &prediction)?;
        }
        Ok(None)
    }

    /// A table that is transposed shows in a run over the first time alone.
    fn check_layout(&self, window: &Arc<Window>, prediction: &Prediction<Held>) -> Result<(), TrialError> {
        let (n, n_times) = (self.study.setup.outputs.len(), window.times.len());
        if n < 2 || n_times < 2 {
            return Ok(());
        }
        let first = Window {
            times: window.times[..1].to_vec(),
            observed: window.observed[..n].to_vec(),
            ..Window::clone(window)
        };
        let alone = match self.run(&Arc::new(first), None) {
            Ok(alone) => alone,
            // With as many times as outputs, only this run lets the solver's reader see it.
            Err(Fault::Run(source)) if source.to_string().contains("is transposed") => {
                return Err(self.failed(Fault::Run(source), "over its first time alone".to_owned()));
            }
            Err(_) => return Ok(()),
        };
        if !is_transposed((&prediction.outputs, n_times), (&alone.outputs, 1), n) {
            return Ok(());
        }
        let what = "it is transposed: all times of the first output come first, where all outputs of the first time belong";
        Err(TrialError::Table { record: self.name(), what: what.to_owned() })
    }
}

fn end(window: &Window) -> f64 {
    window.times.last().copied().unwrap_or(window.start)
}
