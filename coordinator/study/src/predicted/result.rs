//! Bands and numbers of an ensemble: the course of a quantity, and its mean, lowest and highest value over a record.
//!
//! A value over time, such as a highest one, is taken in every member by itself: it is no value of a band.

use serde::{Deserialize, Serialize};
use starlings_estimators::forecast::central95;

use crate::Study;
use crate::field::unit_of;

/// The course of one output over one record; the four vectors have equal length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PredictedCourse {
    /// Name of the record.
    pub record: String,
    /// The output or scalar state, `field[i]` for a component.
    pub output: String,
    /// Its unit label.
    pub unit: String,
    /// Times, those of the record and regular ones where the study asks for them.
    pub time: Vec<f64>,
    /// Median of the members.
    pub median: Vec<f64>,
    /// Lower end of the central 95 % interval at each time by itself.
    pub lo: Vec<f64>,
    /// Upper end of it.
    pub hi: Vec<f64>,
}

/// A number with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Median of the members.
    pub estimate: f64,
    /// Central 95 % interval.
    pub interval95: [f64; 2],
}

/// One output over one record in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PredictedOutput {
    /// Name of the record.
    pub record: String,
    /// The output or scalar state, `field[i]` for a component.
    pub output: String,
    /// Its unit label.
    pub unit: String,
    /// Mean over time, by the trapezoidal rule.
    pub mean: Figure,
    /// Lowest value.
    pub lowest: Figure,
    /// Highest value.
    pub highest: Figure,
}

impl PredictedCourse {
    pub(super) fn of(study: &Study, record: &str, output: &str, times: &[f64], courses: &[Vec<f64>]) -> Self {
        let mut course = Self {
            record: record.to_owned(),
            output: output.to_owned(),
            unit: unit_of(&study.spec, output),
            time: times.to_vec(),
            median: Vec::with_capacity(times.len()),
            lo: Vec::with_capacity(times.len()),
            hi: Vec::with_capacity(times.len()),
        };
        for k in 0..times.len() {
            let Figure { estimate, interval95: [lo, hi] } = Figure::of(courses.iter().map(|c| c[k]));
            course.median.push(estimate);
            course.lo.push(lo);
            course.hi.push(hi);
        }
        course
    }
}

impl Figure {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let [lo, estimate, hi] = central95(values.collect());
        Self { estimate, interval95: [lo, hi] }
    }
}

impl PredictedOutput {
    pub(super) fn of(study: &Study, record: &str, output: &str, times: &[f64], courses: &[Vec<f64>]) -> Self {
        let over = |value: &dyn Fn(&[f64]) -> f64| Figure::of(courses.iter().map(|course| value(course)));
        Self {
            record: record.to_owned(),
            output: output.to_owned(),
            unit: unit_of(&study.spec, output),
            mean: over(&|course| mean(times, course)),
            lowest: over(&|course| course.iter().copied().fold(f64::INFINITY, f64::min)),
            highest: over(&|course| course.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        }
    }

    /// Its numbers with their names.
    pub fn figures(&self) -> [(&'static str, Figure); 3] {
        [("mean", self.mean), ("lowest", self.lowest), ("highest", self.highest)]
    }
}

/// The mean over time.
fn mean(times: &[f64], values: &[f64]) -> f64 {
    let span = times[times.len() - 1] - times[0];
    if span <= 0.0 {
        return values[0];
    }
    let pairs = times.windows(2).zip(values.windows(2));
    pairs.map(|(t, v)| 0.5 * (t[1] - t[0]) * (v[0] + v[1])).sum::<f64>() / span
}

#[cfg(test)]
mod tests {
    use super::mean;

    #[test]
    fn a_mean_weighs_values_by_the_time_that_they_stand_for() {
        // 0 to 1 in one unit of time, then 1 for three more: 0.5 + 3 over 4.
        assert!((mean(&[0.0, 1.0, 4.0], &[0.0, 1.0, 1.0]) - 0.875).abs() < 1e-15);
        assert!((mean(&[2.0], &[7.0]) - 7.0).abs() < 1e-15);
    }
}
