//! The rows of the run's tables, as plain data.

use super::Answer;

/// One row of the table `jobs`.
#[derive(Clone, Debug, PartialEq)]
pub struct JobRow {
    /// Pass, from 1; 0 for the final forward run.
    pub pass: usize,
    /// Analysis within the pass, from 0.
    pub step: usize,
    /// Record name.
    pub record: String,
    /// Sigma point.
    pub particle: u32,
    /// How often it was tried.
    pub attempts: u32,
    /// The worker that answered last.
    pub worker: String,
    /// The failure, or `None` when it succeeded.
    pub error: Option<String>,
    /// Wall time of the run in s.
    pub cost_s: f64,
    /// What it answered, where that is kept.
    pub answer: Option<Answer>,
}

/// One parameter's estimate after one analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimateRow {
    /// Name in the estimated vector.
    pub parameter: String,
    /// Median, physical units.
    pub estimate: f64,
    /// Estimate − 2 sd, taken in transformed units.
    pub lo: f64,
    /// Estimate + 2 sd, taken in transformed units.
    pub hi: f64,
    /// Mean in transformed units.
    pub mean: f64,
    /// Standard deviation in transformed units.
    pub sd: f64,
}

/// One innovation: observed minus predicted before the analysis that used it.
#[derive(Clone, Debug, PartialEq)]
pub struct InnovationRow {
    /// Record name.
    pub record: String,
    /// Output name.
    pub output: String,
    /// Time in the study's unit.
    pub time: f64,
    /// Observed minus predicted.
    pub innovation: f64,
    /// Its standard deviation as the filter expected it.
    pub sd: f64,
}

/// Everything one analysis leaves behind.
#[derive(Clone, Debug)]
pub struct AnalysisRow {
    /// Pass, from 1.
    pub pass: usize,
    /// Analysis within the pass, from 0.
    pub step: usize,
    /// Largest time of the step's windows since their records' starts.
    pub time: f64,
    /// Observations used.
    pub n_used: usize,
    /// Normalised innovation squared, summed over the observations.
    pub nis: f64,
    /// Innovation log-likelihood.
    pub log_likelihood: f64,
    /// Share of the spread lost to pulled or dropped sigma points.
    pub information_lost: f64,
    /// One row per estimated parameter.
    pub estimates: Vec<EstimateRow>,
    /// One row per used observation.
    pub innovations: Vec<InnovationRow>,
    /// One row per run.
    pub jobs: Vec<JobRow>,
}

/// One observation time of the final forward run.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictionRow {
    /// Record name.
    pub record: String,
    /// Output name.
    pub output: String,
    /// Time in the study's unit.
    pub time: f64,
    /// Observed value, if there is one.
    pub observed: Option<f64>,
    /// Value predicted by a free run with the estimate.
    pub predicted: f64,
    /// `train`, `held-out` or `held-out-channel`.
    pub usage: String,
    /// Standard deviation of the channel's noise.
    pub noise: f64,
}
