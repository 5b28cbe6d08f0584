//! What is told after a block, as one line of JSON.
//!
//! Next file to read: [`super`].

use std::collections::BTreeMap;

use serde::Serialize;
use starlings_estimators::inference::{Posterior, Report, Structure};

/// The estimate after a block, and what the detector says of the last blocks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// Time of the last row.
    pub time: f64,
    /// Steps so far.
    pub n_step: u64,
    /// Mean and standard deviation of every coefficient; null where nothing is known of it yet.
    pub coefficients: BTreeMap<String, Option<[f64; 2]>>,
    /// Variances of the noise per time unit; null while they cannot be estimated.
    pub diffusion: Option<Vec<f64>>,
    /// Whether errors of the measurement were taken out of the noise.
    pub lag_corrected: bool,
    /// Why there is no estimate or no test, where more rows alone do not mend it.
    pub error: Option<String>,
    /// Whether the last blocks no longer fit those before.
    pub alarm: bool,
    /// The test; null while there is no reference.
    pub test: Option<Test>,
}

/// The test of the last blocks against those before: of stretches of several lengths the one that fits worst.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Test {
    /// When the stretch that was tested begins; of an alarm, when the change was.
    pub since: f64,
    /// Square of the score.
    pub statistic: f64,
    /// Directions that it has.
    pub degrees: usize,
    /// Probability, at most, of such a square in any of a block's tests without a change, on average over blocks.
    pub probability: f64,
    /// The coefficient whose score is largest, with it.
    pub largest: Option<(String, f64)>,
    /// Coefficients of which nothing was known before.
    pub appeared: Vec<String>,
}

/// The line of a block.
pub(crate) fn line(
    time: f64,
    n_step: u64,
    posterior: Option<&Posterior>,
    report: Option<&Report>,
    structure: &Structure,
) -> Line {
    let name = |p: usize| structure.coefficients()[p].name.clone();
    let value = |p: usize| posterior.and_then(|found| found.estimates[p].value).map(|v| [v.mean, v.sd]);
    let test = |report: &Report| {
        let scores = report.change.scores.iter();
        let largest = scores.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        Test {
            since: report.since,
            statistic: report.change.statistic,
            degrees: report.change.degrees,
            probability: report.by_chance,
            largest: largest.map(|(p, score)| (name(*p), *score)),
            appeared: report.change.appeared.iter().map(|p| name(*p)).collect(),
        }
    };
    Line {
        time,
        n_step,
        coefficients: (0..structure.n_coefficient()).map(|p| (name(p), value(p))).collect(),
        diffusion: posterior.map(|found| found.diffusion.diagonal().iter().copied().collect()),
        lag_corrected: false,
        error: None,
        alarm: report.is_some_and(|report| report.alarm),
        test: report.map(test),
    }
}
