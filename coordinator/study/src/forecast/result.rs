//! The result of a forecast: what is written as `forecast.json`, and the courses that its tables and figures show.

use serde::Serialize;
use starlings_estimators::forecast::{Crossings, Direction, Fan};

use super::Threshold;
use super::ensemble::MeasuredValue;
use super::measurement::Errors;
use crate::Study;
use crate::field::unit_of;

/// A forecast.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// Name of the study.
    pub study: String,
    /// Kind of the model.
    pub model: String,
    /// The record whose start and inputs were used.
    pub record: String,
    /// Unit label of every time.
    pub time_unit: String,
    /// First time.
    pub from: f64,
    /// Last time of the record.
    pub measured_until: f64,
    /// Last time of the forecast.
    pub until: f64,
    /// Members that were drawn.
    pub members: usize,
    /// Members without a prediction; the figures are of the others.
    pub failed: usize,
    /// Seed of draws and noise.
    pub seed: u64,
    /// Whether members have noise of the model's states.
    pub model_noise: bool,
    /// By how many times the sd of a parameter that the members are drawn with exceeds that at the stated noise, at the most;
    /// `None` where the run has no intervals given the residuals and they are drawn at the stated noise.
    pub wider_given_residuals: Option<f64>,
    /// What the bands are conditional on.
    pub conditional_on: String,
    /// Values that all members have.
    pub set: Vec<(String, f64)>,
    /// What is doubtful.
    pub warnings: Vec<String>,
    /// Courses by output.
    pub outputs: Vec<OutputForecast>,
    /// Levels, in the order in which they were asked for.
    pub levels: Vec<LevelForecast>,
}

/// Share of held-out values in a band of 90 % below which it is said to be too narrow.
const SHORT: f64 = 0.8;

/// Quantiles of what would be measured, with its errors.
pub(super) struct Band {
    pub(super) fan: Fan,
    pub(super) errors: Errors,
    /// The same with the errors that the fitted outputs have, and their standard deviation, where the output's own values say more.
    pub(super) by_fit: Option<(Fan, f64)>,
}

/// The course of one output.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OutputForecast {
    /// Its name.
    pub output: String,
    /// Its unit label.
    pub unit: String,
    /// Median and central 90 % interval of the quantity at the last time.
    pub at_end: [f64; 3],
    /// Central 90 % interval of what would be measured at the last time; none of an output that is not measured.
    pub measured_at_end: Option<[f64; 2]>,
    /// The errors in what would be measured.
    pub errors: Option<Errors>,
    /// Shares of measured values within the 90 % band of what would be measured.
    pub coverage90: Option<Coverage>,
    /// Quantiles of the quantity.
    #[serde(skip)]
    pub fan: Fan,
    /// Quantiles of what would be measured, with its errors.
    #[serde(skip)]
    pub measured: Option<Fan>,
    /// Measured values: time, value.
    #[serde(skip)]
    pub observed: Vec<(f64, f64)>,
}

/// Shares of measured values within the 90 % band.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Coverage {
    /// Of those that were fitted.
    pub train: Option<f64>,
    /// Of those that were not.
    pub held_out: Option<f64>,
    /// Of those in the band that the fitted outputs alone would give, where the output was never fitted and its own values widen it.
    pub held_out_by_fit: Option<f64>,
    /// The standard deviation of errors in that band.
    pub sd_by_fit: Option<f64>,
}

/// When a level is crossed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelForecast {
    /// The output.
    pub output: String,
    /// Its unit label.
    pub unit: String,
    /// From which side.
    pub direction: Direction,
    /// The level.
    pub value: f64,
    /// Members that cross it.
    pub crossed: usize,
    /// Members that do not, up to the last time.
    pub never: usize,
    /// Probability of a crossing up to the last time.
    pub probability: f64,
    /// The horizon that was asked for.
    pub horizon: Option<f64>,
    /// Probability of a crossing up to the horizon.
    pub probability_by_horizon: Option<f64>,
    /// Median time over all members; none where half of them do not cross.
    pub median: Option<f64>,
    /// Central 90 % interval over all members; none where 5 % of them do not cross.
    pub interval90: Option<[f64; 2]>,
    /// The answer in a sentence.
    pub says: String,
    /// First crossings, sorted.
    #[serde(skip)]
    pub times: Vec<f64>,
}

impl OutputForecast {
    pub(super) fn new(
        study: &Study,
        name: &str,
        fan: Fan,
        measured: Option<Band>,
        values: &[MeasuredValue],
    ) -> Self {
        let last = fan.times.len() - 1;
        let observed = values.iter().map(|measured| (measured.time, measured.value)).collect();
        let ends = |fan: &Fan| [0.05, 0.95].map(|p| at(fan, p, last));
        let measured_at_end = measured.as_ref().map(|band| ends(&band.fan));
        let coverage90 = measured.as_ref().map(|band| Coverage::of(band, values));
        let (band, errors) = measured.map(|band| (band.fan, band.errors)).unzip();
        let at_end = [0.5, 0.05, 0.95].map(|p| at(&fan, p, last));
        Self {
            output: name.to_owned(),
            unit: unit_of(&study.spec, name),
            at_end,
            measured_at_end,
            errors,
            coverage90,
            fan,
            measured: band,
            observed,
        }
    }
}

impl OutputForecast {
    /// What has to be said where the fitted outputs do not show how far off this one is.
    pub(super) fn says_what_no_fit_shows(&self) -> Option<String> {
        let Coverage { held_out_by_fit: Some(share), sd_by_fit: Some(sd), .. } = self.coverage90? else {
            return None;
        };
        let own = self.errors?.sd;
        (share < SHORT).then(|| {
            format!(
                "what was fitted does not show how far off `{}` is, which never was: errors of {sd:.3} {unit} would hold {:.1} % of its values \
                 in the 90 % band; its own, {own:.3} {unit}, widen it: the model is wrong there (`starlings explain` asks for what it lacks)",
                self.output,
                100.0 * share,
                unit = self.unit,
            )
        })
    }
}

/// The quantile of this probability at the time of this number.
fn at(fan: &Fan, p: f64, k: usize) -> f64 {
    let row = fan.probabilities.iter().position(|q| (q - p).abs() < 1e-9);
    row.map_or(f64::NAN, |row| fan.quantiles[row][k])
}

/// Whether a value lies in the central 90 % of a fan.
fn holds(fan: &Fan, measured: &MeasuredValue) -> bool {
    let k = fan.times.partition_point(|time| *time < measured.time).min(fan.times.len() - 1);
    at(fan, 0.05, k) <= measured.value && measured.value <= at(fan, 0.95, k)
}

impl Coverage {
    fn of(band: &Band, values: &[MeasuredValue]) -> Self {
        let share = |fan: &Fan, held_out: bool| {
            let of_use = || values.iter().filter(|value| value.held_out == held_out);
            let within = of_use().filter(|value| holds(fan, value)).count();
            let all = of_use().count();
            (all > 0).then(|| within as f64 / all as f64)
        };
        Self {
            train: share(&band.fan, false),
            held_out: share(&band.fan, true),
            held_out_by_fit: band.by_fit.as_ref().and_then(|(fan, _)| share(fan, true)),
            sd_by_fit: band.by_fit.as_ref().map(|(_, sd)| *sd),
        }
    }
}

impl LevelForecast {
    pub(super) fn new(study: &Study, threshold: &Threshold, horizon: Option<f64>, found: Crossings) -> Self {
        let Threshold { output, level } = threshold;
        let (never, until) = (found.n_never(), found.until);
        let side = match level.direction {
            Direction::Above => '>',
            Direction::Below => '<',
        };
        let what = format!("{output} {side} {}", level.value);
        let probability = found.probability_by(until);
        let says = if found.times.is_empty() {
            format!("{what}: not crossed by any of {} members up to {until}", found.n_member)
        } else {
            let median = found.median().map_or_else(
                || "most members do not cross it".to_owned(),
                |median| format!("median {median:.4} {}", study.time_unit),
            );
            format!("{what}: crossed with probability {probability:.3} up to {until}; {median}")
        };
        Self {
            output: output.clone(),
            unit: unit_of(&study.spec, output),
            direction: level.direction,
            value: level.value,
            crossed: found.times.len(),
            never,
            probability,
            horizon,
            probability_by_horizon: horizon.map(|horizon| found.probability_by(horizon)),
            median: found.median(),
            interval90: found.interval(0.9),
            says,
            times: found.times,
        }
    }
}
