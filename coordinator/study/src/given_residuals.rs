//! The intervals given the residuals: one small ensemble around the finished estimate, its slopes and its residuals.
//!
//! One run per parameter beside the estimate gives the slope of every observed value; a parameter with one value per record is
//! moved in all records at once. The runs get the same observed values as the fit's runs: with an observer its corrections are
//! in residuals and slopes alike. The arithmetic is in the `sandwich` module of `starlings-estimators`. None of this enters the
//! posterior. Next files to read: [`crate::predictive`], which takes the same slopes to the predictions, and [`crate::summary`].

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use starlings_estimators::{DataPoint, Gaussian, Residuals};

use super::fit::runner::{self, EnsembleRunner, StepWindows};
use super::fit::stack::stack_outputs;
use super::{RunError, Study, posterior, predictive};

/// Distance of the points from the estimate, in posterior sd: close enough for a model that is nearly linear within one.
const DISTANCE: f64 = 0.1;

/// Why nothing is known where runs beside the estimate fail.
const FAILS: &str = "the model fails beside the estimate";

/// The result for the intervals.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum GivenResiduals {
    /// The posterior is wider.
    Wider {
        /// Factor on the sd of each entry of the estimated vector, at least one.
        factors: Vec<f64>,
        /// Covariance of the estimated vector, transformed units.
        covariance: DMatrix<f64>,
    },
    /// No factor is known; a clause that says why.
    Unknown(String),
}

impl GivenResiduals {
    /// The posterior with its covariance given the residuals, or as it is where that is not known.
    pub(crate) fn widened(&self, posterior: &Gaussian) -> Gaussian {
        match self {
            Self::Wider { covariance, .. } => {
                Gaussian { mean: posterior.mean.clone(), covariance: covariance.clone() }
            }
            Self::Unknown(_) => posterior.clone(),
        }
    }
}

/// What an ensemble beside the estimate says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Beside {
    /// The intervals given the residuals.
    pub given: GivenResiduals,
    /// Standard deviations of the predictions, in their order; `None` where they are not known.
    pub spread: Option<Vec<Option<f32>>>,
}

impl Beside {
    /// Nothing is known, for a reason.
    pub(crate) fn unknown(why: &str) -> Self {
        Self { given: GivenResiduals::Unknown(why.to_owned()), spread: None }
    }
}

/// Runs the records once more, at the estimate and beside it, and compares.
///
/// # Errors
/// When the fleet fails. A model that fails beside the estimate is no error: see [`GivenResiduals::Unknown`].
pub(crate) fn compare(runner: &mut EnsembleRunner<'_>, posterior: &Gaussian) -> Result<Beside, RunError> {
    let study = runner.study();
    if study.drifts() && study.estimator.kind.is_filter() {
        return Ok(Beside::unknown(
            "a parameter drifts, and its value at the end is no parameter of the whole record",
        ));
    }
    let (whole, trained) = (predictive::whole_windows(study), study.trained_windows());
    let n_time = |windows: &StepWindows| windows.iter().map(|(_, window)| window.times.len()).sum::<usize>();
    let is_free = study.observer_is_off();
    // A run to a record's end serves the predictions too. One that fails there may still reach the end of the training span.
    if is_free && let Some(points) = beside(runner, posterior, &whole)? {
        let given = Slopes::of(study, &whole, &points).compare(posterior)?;
        let spread = predictive::spread(study, &whole, &points, &given.widened(posterior));
        return Ok(Beside { given, spread: Some(spread) });
    }
    if is_free && n_time(&whole) == n_time(&trained) {
        return Ok(Beside::unknown(FAILS));
    }
    let Some(points) = beside(runner, posterior, &trained)? else {
        return Ok(Beside::unknown(FAILS));
    };
    let given = Slopes::of(study, &trained, &points).compare(posterior)?;
    if is_free {
        return Ok(Beside { given, spread: None });
    }
    let free: StepWindows =
        (0..study.records.len()).map(|record| (record, Arc::new(study.whole(record, false)))).collect();
    let spread = beside(runner, posterior, &free)?
        .map(|points| predictive::spread(study, &free, &points, &given.widened(posterior)));
    Ok(Beside { given, spread })
}

/// Points around the estimate and their predictions: column 0 is the estimate, then one parameter of the study moved in each.
pub(crate) struct Points {
    /// Estimated vectors, p x (q + 1).
    pub(crate) theta: DMatrix<f64>,
    /// Predictions, m x (q + 1).
    pub(crate) outputs: DMatrix<f64>,
}

/// An ensemble on the one side of the estimate, or on the other where a run fails: its points and predictions.
fn beside(
    runner: &mut EnsembleRunner<'_>,
    posterior: &Gaussian,
    windows: &StepWindows,
) -> Result<Option<Points>, RunError> {
    let study = runner.study();
    let sd = posterior::standard_deviations(posterior);
    for side in [1.0, -1.0] {
        let theta = DMatrix::from_fn(sd.len(), study.parameters.len() + 1, |j, particle| {
            let moved = particle == study.theta[j].parameter + 1;
            posterior.mean[j] + if moved { side * DISTANCE * sd[j] } else { 0.0 }
        });
        if let Some(outputs) = run(runner, &theta, windows)? {
            return Ok(Some(Points { theta, outputs }));
        }
    }
    Ok(None)
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

/// The slopes of what was observed.
struct Slopes<'a> {
    study: &'a Study,
    windows: &'a StepWindows,
    outputs: &'a DMatrix<f64>,
    theta: &'a DMatrix<f64>,
}

impl<'a> Slopes<'a> {
    fn of(study: &'a Study, windows: &'a StepWindows, Points { theta, outputs }: &'a Points) -> Self {
        Self { study, windows, outputs, theta }
    }

    fn compare(&self, posterior: &Gaussian) -> Result<GivenResiduals, RunError> {
        let rows = self.rows();
        if rows.iter().any(|row| self.outputs.row(row.at).iter().any(|v| !v.is_finite())) {
            let why = "the model predicts what is no finite number beside the estimate";
            return Ok(GivenResiduals::Unknown(why.to_owned()));
        }
        let jacobian = DMatrix::from_fn(rows.len(), self.study.theta.len(), |k, j| self.slope(&rows[k], j));
        let values = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.residual(self.outputs)));
        let places: Vec<DataPoint> = rows.iter().map(|row| row.place).collect();
        let factors =
            |jacobian: &DMatrix<f64>| Residuals { jacobian, values: &values, places: &places }.inflation();
        let prior_sd =
            DVector::from_iterator(self.study.theta.len(), self.study.theta.iter().map(|t| t.prior_sd));
        let axes = Axes::of(posterior, prior_sd);
        let (Some(of_entries), Some(of_axes)) = (factors(&jacobian)?, factors(&(&jacobian * &axes.vectors))?)
        else {
            let (n, p) = (rows.len(), self.study.theta.len());
            let why = format!("{n} residuals of {p} parameters say too little of themselves");
            return Ok(GivenResiduals::Unknown(why));
        };
        Ok(GivenResiduals::Wider { factors: of_entries, covariance: axes.stretched(&of_axes) })
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

/// The principal axes of the posterior in units of the prior sd: directions that the data know independently of one another,
/// from what they determine best to what the prior alone says.
struct Axes {
    prior_sd: DVector<f64>,
    /// Unit vectors in columns, p x p.
    vectors: DMatrix<f64>,
    variances: DVector<f64>,
}

impl Axes {
    fn of(posterior: &Gaussian, prior_sd: DVector<f64>) -> Self {
        let n = prior_sd.len();
        let covariance = &posterior.covariance;
        let even = DMatrix::from_fn(n, n, |i, j| {
            0.5 * (covariance[(i, j)] + covariance[(j, i)]) / (prior_sd[i] * prior_sd[j])
        });
        let SymmetricEigen { eigenvectors, eigenvalues } = even.symmetric_eigen();
        Self { prior_sd, vectors: eigenvectors, variances: eigenvalues.map(|v| v.max(0.0)) }
    }

    /// The covariance in transformed units with the sd along each axis so many times larger. A factor per parameter would
    /// spread the combinations that the data determine far better than any parameter by itself.
    fn stretched(&self, factors: &[f64]) -> DMatrix<f64> {
        let scaled = DVector::from_fn(factors.len(), |k, _| factors[k].powi(2) * self.variances[k]);
        let to_units = DMatrix::from_diagonal(&self.prior_sd) * &self.vectors;
        let covariance = &to_units * DMatrix::from_diagonal(&scaled) * to_units.transpose();
        (&covariance + covariance.transpose()) * 0.5
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_stretch_what_residuals_stretch_and_leave_the_rest() {
        // Two parameters whose sum is known to 0.02 and whose difference is known to 2.
        let (narrow, wide) = (0.02_f64.powi(2), 2.0_f64.powi(2));
        let covariance = |narrow: f64, wide: f64| {
            let (same, other) = (0.25 * (narrow + wide), 0.25 * (narrow - wide));
            DMatrix::from_row_slice(2, 2, &[same, other, other, same])
        };
        let posterior = Gaussian { mean: DVector::zeros(2), covariance: covariance(narrow, wide) };
        let axes = Axes::of(&posterior, DVector::from_element(2, 3.0));
        assert!((axes.stretched(&[1.0, 1.0]) - &posterior.covariance).amax() < 1e-12);
        // The sum's factor is 5 and the difference's 1, in whichever order the axes come.
        let factors = axes.variances.map(|v| if v < 0.01 { 5.0 } else { 1.0 });
        let wider = axes.stretched(factors.as_slice());
        assert!((wider - covariance(25.0 * narrow, wide)).amax() < 1e-12);
    }
}
