//! The result of an inference: tables with intervals, as they are written and read by programs.
//!
//! Nothing in it depends on who computed it. Next file to read: `answer.rs`, which fills it.

use serde::{Deserialize, Serialize};
use starlings_estimators::inference::NoiseCheck;

/// Probability with which an interval holds its coefficient.
pub const LEVEL: f64 = 0.9;

/// An inference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inference {
    /// Name of the study.
    pub study: String,
    /// What was found, in one sentence.
    pub verdict: String,
    /// Where the study file stood.
    #[serde(default)]
    pub file: String,
    /// Unit label of every time.
    pub time_unit: String,
    /// The recordings.
    pub records: Vec<RecordUsed>,
    /// Sampling step.
    pub step: f64,
    /// Steps of all records.
    pub n_step: u64,
    /// Steps of a block.
    pub block: usize,
    /// The equations, by the names of their states.
    pub equations: Vec<String>,
    /// The coefficients of the drift.
    pub coefficients: Vec<CoefficientFound>,
    /// Covariance of those coefficients that have an estimate, row by row in their order.
    #[serde(default)]
    pub covariance: Vec<Vec<f64>>,
    /// The noise.
    pub diffusion: DiffusionFound,
    /// What the residuals of neighbouring steps say of errors of the measurement.
    pub noise_checks: Vec<NoiseCheck>,
    /// Equations whose noise is not constant.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub noise_varies: Vec<NoiseVaries>,
    /// Whether the intervals of the coefficients hold for noise of any size in each step.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub robust: bool,
    /// The extrapolation to no step, where it was asked for.
    pub richardson: Option<RichardsonFound>,
    /// The reduced model, where there is one.
    pub reduced: Option<ReducedFound>,
    /// Terms that the drift lacks, where they were looked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing: Option<MissingFound>,
    /// The estimate after each power of two of blocks, and after all.
    pub convergence: Vec<Converging>,
    /// In what these estimates differ from the table, where they do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convergence_of: Option<String>,
    /// What the intervals are conditional on.
    pub conditional_on: String,
    /// What is doubtful.
    pub warnings: Vec<String>,
}

/// A recording as far as it was used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordUsed {
    /// Its name.
    pub name: String,
    /// Steps that were used.
    pub n_step: u64,
    /// Its first and last time.
    pub span: [f64; 2],
}

/// A coefficient.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoefficientFound {
    /// Its name.
    pub name: String,
    /// Whether the data say anything of it.
    pub observed: bool,
    /// Posterior mean; `None` where neither data nor prior say anything.
    pub estimate: Option<f64>,
    /// Posterior standard deviation.
    pub sd: Option<f64>,
    /// Interval that holds it with a probability of 90 %.
    pub interval90: Option<[f64; 2]>,
    /// Whether that interval holds zero.
    pub may_be_zero: Option<bool>,
    /// The estimate at the sampling step, where it was extrapolated to none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_step: Option<f64>,
    /// Mean and standard deviation before the data, where something was known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<[f64; 2]>,
}

/// The noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiffusionFound {
    /// `full`, `diagonal` or `isotropic`.
    pub form: String,
    /// Covariance per time unit, row by row.
    pub matrix: Vec<Vec<f64>>,
    /// Standard deviations of its entries.
    pub sd: Vec<Vec<f64>>,
    /// Intervals of the variances, one per equation.
    pub interval90: Vec<Option<[f64; 2]>>,
    /// Degrees of freedom of every variance.
    #[serde(default)]
    pub degrees: Option<f64>,
    /// Whether errors of the measurement were taken out of it.
    pub lag_corrected: bool,
    /// Standard deviation of the measurement, where it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_sd: Option<f64>,
}

/// Noise that is not constant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseVaries {
    /// The equation.
    pub equation: String,
    /// The state or input with which it varies most; `None` for the course of the recordings.
    pub with: Option<String>,
    /// Where it is smallest and where it is largest: values of that, or shares of all rows that lie before.
    pub at: [f64; 2],
    /// Standard deviation at the second over that at the first; `None` where there is no noise at all at the first.
    #[serde(default)]
    pub ratio: Option<f64>,
    /// N R² of the regression that shows it, with two degrees of freedom.
    pub chi_squared: f64,
    /// Probability, at most, of as much in any equation by constant noise.
    pub by_chance: f64,
}

/// The extrapolation to no step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RichardsonFound {
    /// Order of the step's error that was used, 1 or 2.
    pub order: u32,
    /// Change from 4h to 2h over that from 2h to h.
    pub ratio: Option<f64>,
}

/// The reduced model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReducedFound {
    /// Its unknowns.
    pub unknowns: Vec<UnknownFound>,
    /// χ² of what it leaves of the coefficients.
    pub chi_squared: f64,
    /// Coefficients less unknowns.
    pub degrees: usize,
    /// Probability of a larger χ² where it is right.
    pub probability: f64,
    /// Whether that probability is above 1 %.
    pub consistent: bool,
}

/// An unknown of the reduced model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnknownFound {
    /// Its name.
    pub name: String,
    /// Estimate.
    pub estimate: f64,
    /// Standard deviation.
    pub sd: f64,
    /// Interval that holds it with a probability of 90 %.
    pub interval90: [f64; 2],
}

/// What was found of terms that the drift may lack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MissingFound {
    /// Candidates that were tried.
    pub candidates: usize,
    /// Probability of naming anything where nothing is missing.
    pub false_alarm: f64,
    /// The terms that are named, in the order of the equations.
    pub named: Vec<NamedTerm>,
    /// Candidates by themselves beside the model, the strongest first.
    pub strongest: Vec<ScoredTerm>,
    /// All candidates that are not named, together beside the model with the named terms; `None` where these span them all.
    pub left: Option<JointScore>,
    /// Recordings that nothing was inferred from, where there are any.
    pub held_out: Option<HeldOut>,
    /// The coefficients of the model and of the named terms, fitted together.
    pub coefficients: Vec<CoefficientFound>,
}

/// A term that the drift lacks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedTerm {
    /// Equation and function.
    pub name: String,
    /// Posterior mean of its coefficient.
    pub estimate: f64,
    /// Posterior standard deviation.
    pub sd: f64,
    /// Interval that holds it with a probability of 90 %.
    pub interval90: [f64; 2],
    /// χ² of its coefficient against zero, beside everything else that is named.
    pub chi_squared: f64,
    /// Probability of as much by chance, for this candidate alone.
    pub by_chance: f64,
    /// Candidates that the data take as well in its place.
    pub ties: Vec<String>,
}

/// A candidate by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScoredTerm {
    /// Equation and function.
    pub name: String,
    /// χ² of its coefficient against zero.
    pub chi_squared: f64,
    /// Probability of as much by chance, for this candidate alone.
    pub by_chance: f64,
}

/// Candidates together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointScore {
    /// How many, without those that the others span.
    pub terms: usize,
    /// χ² of their coefficients against zero.
    pub chi_squared: f64,
    /// Probability of as much by chance.
    pub by_chance: f64,
}

/// What named terms do for recordings that nothing was inferred from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Names of the records.
    pub records: Vec<String>,
    /// Their steps.
    pub n_step: u64,
    /// By how much the log-likelihood grows with the named terms, in nats, at what was inferred from the other records.
    pub gain: f64,
}

/// An estimate on the way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Converging {
    /// Blocks so far.
    pub n_block: u64,
    /// Steps so far.
    pub n_step: u64,
    /// Time that the steps cover.
    pub time: f64,
    /// Mean and standard deviation of every coefficient that has a value.
    pub values: Vec<Option<[f64; 2]>>,
    /// Variances of the noise.
    pub diffusion: Vec<f64>,
}
