//! One ensemble on the fleet: every record from its start, freely, for star points close to one point.
//!
//! A parameter with one value per record is moved in all records at once: a record depends on its own value only, so one pair
//! of runs gives the derivative of each. That makes 2q + 1 runs of every record for q parameters of the study.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::{EstimatorError, Points, SigmaSet, sigma_point_sensitivities};
use starlings_models::Window;

use super::IdentifyError;
use crate::Study;

use crate::fit::runner::{AnalysisIndex, EnsembleRunner, Predicted, Results, StepWindows};
use crate::trial::rounding;

/// Least distance of the points from their centre, in prior sd: closer, rounding inside the model would show.
const CLOSEST: f64 = 1e-3;

/// One observed value of the design.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Index in [`Study::records`].
    pub record: usize,
    /// Observation time.
    pub time: f64,
    /// Index in the outputs of the setup.
    pub output: usize,
    /// Noise sd, in the channel's unit.
    pub noise: f64,
    /// Prediction at the centre.
    pub prediction: f64,
    /// Number of its observation time, counted through the records in order.
    pub step: usize,
}

/// The slopes of the predictions of all observed values by the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// The observed values: records in order, then times, then outputs.
    pub rows: Vec<Row>,
    /// d prediction / d theta over the noise sd, one row per value, one column per entry of the estimated vector.
    pub whitened: DMatrix<f64>,
    /// Runs of the model.
    pub runs: u64,
}

/// Distance of the points from their centre, in prior sd; further where a solver rounds, unless the study says how far.
pub fn spread(study: &Study) -> f64 {
    study.estimator.spread.max(CLOSEST).max(rounding::apart_in_prior_sd(study))
}

/// Relative accuracy of central differences at this distance: their error is of second order in it.
pub fn accuracy(spread: f64) -> f64 {
    spread * spread
}

/// Which observed values a run is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// None: it runs freely, whatever the observer.
    Freely,
    /// Those of a run of the fit: an observer corrects it.
    AsFitted,
}

/// Runs the ensemble around `centre` (transformed units).
///
/// # Errors
/// When the fleet fails, or the model fails at one of the points.
pub(crate) fn run(runner: &mut EnsembleRunner<'_>, centre: &[f64]) -> Result<Response, IdentifyError> {
    run_with(runner, centre, Points::Star, Seen::Freely)
}

/// The same with other points.
///
/// # Errors
/// When the fleet fails, or the model fails at one of the points.
pub(crate) fn run_with(
    runner: &mut EnsembleRunner<'_>,
    centre: &[f64],
    points: Points,
    seen: Seen,
) -> Result<Response, IdentifyError> {
    let study = runner.study();
    let set = SigmaSet::new(points, study.parameters.len())?;
    let reach = set.points.amax();
    let points = Around { study, centre, set, scale: spread(study) / reach };
    let observed = windows(study, Seen::AsFitted);
    let sent = windows(study, seen);
    let results = runner.run_from_start(AnalysisIndex { pass: 0, step: 2 }, &points.theta(), &sent)?;
    points.check(&results, &sent)?;
    let (rows, predictions) = points.gather(&observed, &results)?;
    let whitened = points.whitened(&rows, &predictions)?;
    Ok(Response { rows, whitened, runs: (points.set.n_particle() * sent.len()) as u64 })
}

/// Every trained record from its start.
pub fn windows(study: &Study, seen: Seen) -> StepWindows {
    let mut windows = study.trained_windows();
    if seen == Seen::Freely {
        for (_, window) in &mut windows {
            *window = Arc::new(freed(window));
        }
    }
    windows
}

/// What one run of every window predicts of the given rows; `None` when a run failed or a value is not finite.
pub fn outputs(
    study: &Study,
    windows: &StepWindows,
    results: &[Predicted],
    rows: &[Row],
) -> Option<DVector<f64>> {
    let n_out = study.setup.outputs.len();
    let mut values = Vec::with_capacity(rows.len());
    let mut step = 0;
    for ((_, window), result) in windows.iter().zip(results) {
        let prediction = result.as_ref().ok()?;
        let later = rows[values.len()..].iter();
        let of_window = later.take_while(|row| row.step < step + window.times.len());
        let found: Vec<f64> =
            of_window.map(|row| prediction.outputs[(row.step - step) * n_out + row.output]).collect();
        values.extend(found);
        step += window.times.len();
    }
    let finite = values.len() == rows.len() && values.iter().all(|v| v.is_finite());
    finite.then(|| DVector::from_vec(values))
}

/// The same window without an observed value: no observer can correct the run.
fn freed(window: &Window) -> Window {
    Window { observed: vec![f64::NAN; window.observed.len()], ..window.clone() }
}

/// Star points over the parameters of a study, the last one their centre.
struct Around<'a> {
    study: &'a Study,
    centre: &'a [f64],
    set: SigmaSet,
    /// Points are centre + scale * prior sd * I.
    scale: f64,
}

impl Around<'_> {
    /// Particles, p x r, transformed units.
    fn theta(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.centre.len(), self.set.n_particle(), |j, particle| {
            let entry = &self.study.theta[j];
            self.centre[j] + self.scale * entry.prior_sd * self.set.points[(entry.parameter, particle)]
        })
    }

    /// A particle as text: what was moved, and where to.
    fn place(&self, particle: usize, record: usize) -> String {
        let moved = |parameter: usize| self.set.points[(parameter, particle)].abs() > 0.0;
        let Some(parameter) = (0..self.set.n_param()).find(|q| moved(*q)) else {
            return "the point of the analysis itself".to_owned();
        };
        let name = &self.study.parameters[parameter].name;
        let values = self.study.theta_for(record, self.theta().column(particle).into_owned().as_slice());
        let side = if self.set.points[(parameter, particle)] > 0.0 { "upwards" } else { "downwards" };
        format!(
            "{name} = {} ({name} moved {side} by {} prior sd, nothing else)",
            values[parameter],
            spread(self.study)
        )
    }

    fn check(&self, results: &Results, windows: &StepWindows) -> Result<(), IdentifyError> {
        for (particle, of_particle) in results.iter().enumerate() {
            for ((record, _), result) in windows.iter().zip(of_particle) {
                if let Err(source) = result {
                    return Err(IdentifyError::Particle {
                        record: self.study.records[*record].name.clone(),
                        place: self.place(particle, *record),
                        source: source.clone(),
                    });
                }
            }
        }
        Ok(())
    }

    /// The observed values and their predictions, m x r.
    fn gather(
        &self,
        windows: &StepWindows,
        results: &Results,
    ) -> Result<(Vec<Row>, DMatrix<f64>), IdentifyError> {
        let n_out = self.study.setup.outputs.len();
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        let mut step = 0;
        for (place, (record, window)) in windows.iter().enumerate() {
            let noise = self.study.noise(*record);
            for (k, time) in window.times.iter().enumerate() {
                for output in (0..n_out).filter(|output| window.observed[k * n_out + output].is_finite()) {
                    let mut row = Row {
                        record: *record,
                        time: *time,
                        output,
                        noise: noise[output],
                        prediction: 0.0,
                        step,
                    };
                    for (particle, of_particle) in results.iter().enumerate() {
                        let value =
                            of_particle[place].as_ref().map_or(f64::NAN, |p| p.outputs[k * n_out + output]);
                        if !value.is_finite() {
                            return Err(self.not_finite(&row, particle, value));
                        }
                        values.push(value);
                        row.prediction = value;
                    }
                    rows.push(row);
                }
                step += 1;
            }
        }
        let predictions = DMatrix::from_row_slice(rows.len(), self.set.n_particle(), &values);
        Ok((rows, predictions))
    }

    fn not_finite(&self, row: &Row, particle: usize, value: f64) -> IdentifyError {
        IdentifyError::Prediction {
            output: self.study.setup.outputs[row.output].clone(),
            record: self.study.records[row.record].name.clone(),
            time: row.time,
            value,
            place: self.place(particle, row.record),
        }
    }

    /// From columns per parameter of the study to columns per entry of the estimated vector: a record depends on its own.
    fn whitened(&self, rows: &[Row], predictions: &DMatrix<f64>) -> Result<DMatrix<f64>, EstimatorError> {
        let slopes = sigma_point_sensitivities(&self.set, predictions, self.scale)?;
        Ok(DMatrix::from_fn(rows.len(), self.study.theta.len(), |i, j| {
            let entry = &self.study.theta[j];
            let own = entry.record.is_none_or(|record| record == rows[i].record);
            if own { slopes[(i, entry.parameter)] / (entry.prior_sd * rows[i].noise) } else { 0.0 }
        }))
    }
}
