//! The runs of the draws: one per member and record, in one batch.
//!
//! Next file to read: [`super::result`].

use std::sync::Arc;

use starlings_estimators::Gaussian;
use starlings_models::{BuildSetup, Job, ObserverDef, Setup, Window};

use super::times::times_of;
use super::{PredictedCourse, PredictedOutput, Predictions};
use crate::fit::runner::{AnalysisIndex, EnsembleRunner};
use crate::forecast::ensemble::drawn;
use crate::{RunError, Study};

/// What the members predict of one record.
pub(super) struct Members {
    record: usize,
    times: Vec<f64>,
    /// Outputs of those that have a prediction, laid out as [`Window::observed`].
    predicted: Vec<Vec<f64>>,
    /// Why the first that failed did.
    failure: Option<String>,
}

/// Runs the draws of a posterior over every record.
///
/// # Errors
/// When the fleet fails as a whole, or refuses the outputs.
pub(super) fn run(runner: &mut EnsembleRunner<'_>, posterior: &Gaussian) -> Result<Vec<Members>, RunError> {
    let study = runner.study();
    let setup = setup_of(study);
    let members = drawn(posterior, study.predict.members, study.seed);
    let windows: Vec<Arc<Window>> =
        (0..study.records.len()).map(|record| Arc::new(window_of(study, record))).collect();
    let job = |(particle, record): (usize, usize)| Job {
        particle: particle as u32,
        record: record as u32,
        window: Arc::clone(&windows[record]),
        theta: study.theta_for(record, members[particle].as_slice()),
        state: None,
    };
    let places = (0..windows.len()).flat_map(|record| (0..members.len()).map(move |m| (m, record)));
    let jobs: Vec<Job<_>> = places.map(job).collect();
    let mut results = runner.run_others(AnalysisIndex { pass: 0, step: 4 }, &setup, &jobs)?.into_iter();
    let of_record = |(record, window): (usize, &Arc<Window>)| {
        let (mut predicted, mut failure) = (Vec::with_capacity(members.len()), None);
        for result in results.by_ref().take(members.len()) {
            match result {
                Ok(found) if found.outputs.len() == window.observed.len() => predicted.push(found.outputs),
                Ok(_) => failure = failure.or_else(|| Some("an answer of another length".to_owned())),
                Err(error) => failure = failure.or_else(|| Some(error.to_string())),
            }
        }
        Members { record, times: window.times.clone(), predicted, failure }
    };
    Ok(windows.iter().enumerate().map(of_record).collect())
}

/// What the runs are made with: the study's model, free, with the outputs that are predicted.
pub(crate) fn setup_of(study: &Study) -> Setup {
    let mut setup = study.setup.clone();
    setup.observer = ObserverDef::default();
    setup.noise = study.setup.is_noisy().then_some(study.seed);
    setup.outputs.clone_from(&study.predict.outputs);
    setup
}

/// Step of the predictions; none where the solver answers at the times of the records only.
pub(crate) fn step_of(study: &Study) -> Option<f64> {
    study.predict.step.filter(|_| !study.whole_answers)
}

/// A record from its start, without any observed value, at the times of the predictions.
pub(crate) fn window_of(study: &Study, record: usize) -> Window {
    let of_record = &study.records[record];
    let times = times_of(of_record, step_of(study));
    Window::free(of_record.start, times, study.predict.outputs.len(), of_record.inputs.clone())
}

impl Members {
    /// Adds what they predict to what was found, and how many of them failed.
    pub(super) fn tell(&self, study: &Study, found: &mut Predictions) {
        let name = &study.records[self.record].name;
        let n_failed = study.predict.members - self.predicted.len();
        if let Some(reason) = self.failure.as_ref().filter(|_| n_failed > 0) {
            found.warnings.push(format!(
                "{n_failed} of {} runs of `[predict]` over record `{name}` have no prediction and are in no band: {reason}",
                study.predict.members
            ));
        }
        if self.predicted.is_empty() {
            return;
        }
        let n_obs = study.predict.outputs.len();
        for (row, output) in study.predict.outputs.iter().enumerate() {
            let of = |outputs: &Vec<f64>| outputs.iter().skip(row).step_by(n_obs).copied().collect();
            let courses: Vec<Vec<f64>> = self.predicted.iter().map(of).collect();
            found.courses.push(PredictedCourse::of(study, name, output, &self.times, &courses));
            found.outputs.push(PredictedOutput::of(study, name, output, &self.times, &courses));
        }
    }
}
