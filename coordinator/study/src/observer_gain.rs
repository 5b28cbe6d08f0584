//! The effect of the observer on the state: one run with it at the estimate, beside the free run without it.
//!
//! Both runs predict the same observations; with the observer each prediction follows the corrections of all earlier ones, at
//! the spacings at which the filter's own runs are corrected. None of this enters the posterior. Next file to read:
//! [`crate::fit::free_run`].

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use starlings_estimators::Gaussian;
use starlings_models::{Failure, Window};
use std::collections::HashMap;

use super::fit::runner::{AnalysisIndex, EnsembleRunner};
use super::store::PredictionRow;
use super::{RunError, Study};

/// The root mean square innovations over the training spans, in noise standard deviations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObserverFit {
    /// The observer; of several their kinds joined by ` + `.
    pub kind: String,
    /// Its gain, of several that of the first, in 1/time unit; that of `windkessel` counts in 1/(R_d C) and has no unit.
    pub gain: f64,
    /// With the observer: every observation predicted from a state corrected by the earlier ones.
    pub innovation_rms_with: f64,
    /// Without it: predicted by a free run.
    pub innovation_rms_without: f64,
}

/// One record's innovations over time, pooled over its channels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObserverCourse {
    /// Record name.
    pub record: String,
    /// Observation times of the training span.
    pub time: Vec<f64>,
    /// Root mean square over the channels with the observer, in noise standard deviations.
    pub with: Vec<f64>,
    /// The same without it.
    pub without: Vec<f64>,
}

/// A comparison of both runs.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Comparison {
    /// The figures.
    pub fit: ObserverFit,
    /// Their course, one entry per record.
    pub courses: Vec<ObserverCourse>,
    /// A sentence per record that is not among them, since the model fails there.
    pub left_out: Vec<String>,
}

/// The result of the comparison.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Compared {
    /// The study has no observer.
    NoObserver,
    /// Both runs, side by side.
    Both(Comparison),
    /// The run with the observer gave nothing to compare; a sentence that says why.
    Failed(String),
}

impl Compared {
    /// Whether the model fails under its observer on some record.
    pub(crate) fn fails(&self) -> bool {
        match self {
            Self::NoObserver => false,
            Self::Both(found) => !found.left_out.is_empty(),
            Self::Failed(_) => true,
        }
    }
}

/// Runs the trained records once more, with the observer, and compares. `free` is the free run at the same estimate.
///
/// # Errors
/// When the fleet fails. A model that fails under its observer at the estimate is no error: see [`Compared::Failed`].
pub(crate) fn compare(
    runner: &mut EnsembleRunner<'_>,
    posterior: &Gaussian,
    free: &[PredictionRow],
) -> Result<Compared, RunError> {
    let study = runner.study();
    if study.observer_is_off() {
        return Ok(Compared::NoObserver);
    }
    let windows = study.trained_windows();
    let theta = DMatrix::from_column_slice(posterior.mean.len(), 1, posterior.mean.as_slice());
    let results = runner.run_from_start(AnalysisIndex { pass: 0, step: 1 }, &theta, &windows)?;
    let (mut courses, mut left_out) = (Vec::new(), Vec::new());
    let mut sums = Sums::default();
    for ((record, window), result) in windows.iter().zip(results.into_iter().flatten()) {
        let prediction = match result {
            Ok(prediction) => prediction,
            Err(error) => {
                left_out.push(failed(study, *record, &error));
                continue;
            }
        };
        courses.push(course(study, *record, window, &prediction.outputs, free, &mut sums));
    }
    if courses.is_empty() && !left_out.is_empty() {
        return Ok(Compared::Failed(left_out.join(" ")));
    }
    let fit = ObserverFit {
        kind: study.setup.observer.name(),
        gain: study.setup.observer.gain,
        innovation_rms_with: sums.with(),
        innovation_rms_without: sums.without(),
    };
    if !(fit.innovation_rms_with.is_finite() && fit.innovation_rms_without.is_finite()) {
        return Ok(Compared::Failed(endless(study)));
    }
    Ok(Compared::Both(Comparison { fit, courses, left_out }))
}

/// The sentence that says what is missing, and why.
fn failed(study: &Study, record: usize, error: &Failure) -> String {
    format!(
        "with the estimated parameters the model fails under the observer `{}` on record `{}` ({error}): innovations with and \
         without the observer leave that record out, and neither the constants that the answer hangs on nor intervals given the \
         residuals are known. Lower its gain.",
        study.setup.observer.name(),
        study.records[record].name
    )
}

fn endless(study: &Study) -> String {
    format!(
        "the innovations under the observer `{}` are no finite numbers: what it does for the state is not known. Lower its \
         gain.",
        study.setup.observer.name()
    )
}

/// Sums of squared whitened innovations.
#[derive(Default)]
struct Sums {
    with: f64,
    without: f64,
    n: u32,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.with += other.with;
        self.without += other.without;
        self.n += other.n;
    }

    fn with(&self) -> f64 {
        (self.with / f64::from(self.n)).sqrt()
    }

    fn without(&self) -> f64 {
        (self.without / f64::from(self.n)).sqrt()
    }
}

fn course(
    study: &Study,
    record: usize,
    window: &Window,
    outputs: &[f64],
    free: &[PredictionRow],
    sums: &mut Sums,
) -> ObserverCourse {
    let of_record = &study.records[record];
    let n_obs = study.setup.outputs.len();
    let mut course = ObserverCourse { record: of_record.name.clone(), ..ObserverCourse::default() };
    let free = free_run(free, &of_record.name);
    for (j, &time) in window.times.iter().enumerate() {
        let mut here = Sums::default();
        for channel in &of_record.channels {
            let at = j * n_obs + channel.row;
            let observed = window.observed[at];
            let Some(without) = free.get(&(channel.output.as_str(), time.to_bits())) else { continue };
            if observed.is_finite() {
                here.with += ((observed - outputs[at]) / channel.noise).powi(2);
                here.without += ((observed - without) / channel.noise).powi(2);
                here.n += 1;
            }
        }
        if here.n > 0 {
            course.time.push(time);
            course.with.push(here.with());
            course.without.push(here.without());
            sums.add(&here);
        }
    }
    course
}

/// Predicted values of a record by output and bits of the time.
fn free_run<'a>(rows: &'a [PredictionRow], record: &str) -> HashMap<(&'a str, u64), f64> {
    let of_record = rows.iter().filter(|row| row.record == record);
    of_record.map(|row| ((row.output.as_str(), row.time.to_bits()), row.predicted)).collect()
}
