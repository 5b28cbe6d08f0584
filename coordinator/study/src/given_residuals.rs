//! The intervals given the residuals: one small ensemble around the finished estimate, its slopes and its residuals.
//!
//! One run per parameter beside the estimate gives the slope of every observed value; a parameter with one value per record is
//! moved in all records at once. The runs get the same observed values as the fit's runs: with an observer its corrections are
//! in residuals and slopes alike. The arithmetic is in the `sandwich` module of `starlings-estimators`. None of this enters the
//! posterior. Next file to read: [`crate::summary`].

use nalgebra::{DMatrix, DVector};
use starlings_estimators::{DataPoint, Gaussian, Residuals};

use super::fit::runner::{self, EnsembleRunner, StepWindows};
use super::fit::stack::stack_outputs;
use super::{RunError, Study, posterior};

/// Distance of the points from the estimate, in posterior sd: close enough for a model that is nearly linear within one.
const DISTANCE: f64 = 0.1;

/// The result for the intervals.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum GivenResiduals {
    /// Factor on the sd of each entry of the estimated vector, at least one.
    Wider(Vec<f64>),
    /// No factor is known; a clause that says why.
    Unknown(String),
}

/// Runs the trained records once more, at the estimate and beside it, and compares.
///
/// # Errors
/// When the fleet fails. A model that fails beside the estimate is no error: see [`GivenResiduals::Unknown`].
pub(crate) fn compare(
    runner: &mut EnsembleRunner<'_>,
    posterior: &Gaussian,
) -> Result<GivenResiduals, RunError> {
    let study = runner.study();
    if study.drifts() && study.estimator.kind.is_filter() {
        let why = "a parameter drifts, and its value at the end is no parameter of the whole record";
        return Ok(GivenResiduals::Unknown(why.to_owned()));
    }
    let sd = posterior::standard_deviations(posterior);
    let windows = study.trained_windows();
    for side in [1.0, -1.0] {
        let theta = DMatrix::from_fn(sd.len(), study.parameters.len() + 1, |j, particle| {
            let moved = particle == study.theta[j].parameter + 1;
            posterior.mean[j] + if moved { side * DISTANCE * sd[j] } else { 0.0 }
        });
        if let Some(outputs) = run(runner, &theta, &windows)? {
            let slopes = Slopes { study, windows: &windows, outputs: &outputs, theta: &theta };
            return slopes.compare();
        }
    }
    Ok(GivenResiduals::Unknown("the model fails beside the estimate".to_owned()))
}

/// The predictions, m x (q + 1); `None` when a run failed or predicted what is no finite number.
fn run(
    runner: &mut EnsembleRunner<'_>,
    theta: &DMatrix<f64>,
    windows: &StepWindows,
) -> Result<Option<DMatrix<f64>>, RunError> {
    let results = runner.run_from_start(runner::AnalysisIndex { pass: 0, step: 3 }, theta, windows)?;
    if results.iter().flatten().any(Result::is_err) {
        return Ok(None);
    }
    Ok(Some(stack_outputs(&results, windows)))
}

/// One ensemble around the estimate: column 0 is the estimate, then one parameter of the study moved in each.
struct Slopes<'a> {
    study: &'a Study,
    windows: &'a StepWindows,
    outputs: &'a DMatrix<f64>,
    theta: &'a DMatrix<f64>,
}

impl Slopes<'_> {
    fn compare(&self) -> Result<GivenResiduals, RunError> {
        let rows = self.rows();
        if rows.iter().any(|row| self.outputs.row(row.at).iter().any(|v| !v.is_finite())) {
            let why = "the model predicts what is no finite number beside the estimate";
            return Ok(GivenResiduals::Unknown(why.to_owned()));
        }
        let jacobian = DMatrix::from_fn(rows.len(), self.study.theta.len(), |k, j| self.slope(&rows[k], j));
        let values = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.residual(self.outputs)));
        let places: Vec<DataPoint> = rows.iter().map(|row| row.place).collect();
        let inflation = Residuals { jacobian: &jacobian, values: &values, places: &places }.inflation()?;
        Ok(inflation.map_or_else(
            || {
                let (n, p) = (rows.len(), self.study.theta.len());
                GivenResiduals::Unknown(format!(
                    "{n} residuals of {p} parameters say too little of themselves"
                ))
            },
            GivenResiduals::Wider,
        ))
    }

    /// The observed values of the training spans, in the order of the predictions.
    fn rows(&self) -> Vec<Row> {
        let n_output = self.study.setup.outputs.len();
        let mut rows = Vec::new();
        let mut first = 0;
        for (record, window) in self.windows {
            let noise = self.study.noise(*record);
            for (k, observed) in window.observed.iter().enumerate().filter(|(_, v)| v.is_finite()) {
                let (time, channel) = (window.times[k / n_output], k % n_output);
                rows.push(Row {
                    at: first + k,
                    observed: *observed,
                    noise: noise[channel],
                    place: DataPoint { record: *record, time, channel },
                });
            }
            first += window.observed.len();
        }
        rows
    }

    /// d prediction / d parameter over the noise, per prior sd. The rows of a record depend on its own value only.
    fn slope(&self, row: &Row, j: usize) -> f64 {
        let entry = &self.study.theta[j];
        if entry.record.is_some_and(|record| record != row.place.record) {
            return 0.0;
        }
        let column = entry.parameter + 1;
        let step = self.theta[(j, column)] - self.theta[(j, 0)];
        if step.is_nan() || step == 0.0 {
            return 0.0;
        }
        let change = self.outputs[(row.at, column)] - self.outputs[(row.at, 0)];
        change / step * entry.prior_sd / row.noise
    }
}

/// One observed value.
struct Row {
    /// Row of the predictions.
    at: usize,
    observed: f64,
    noise: f64,
    place: DataPoint,
}

impl Row {
    fn residual(&self, outputs: &DMatrix<f64>) -> f64 {
        (self.observed - outputs[(self.at, 0)]) / self.noise
    }
}
