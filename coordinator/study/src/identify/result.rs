//! The result of the analysis, in names and units: what `--json` prints, and what the page shows.
//!
//! Widths are in transformed units, as the `sd` of a prior is, unless a field says otherwise. A figure that does not exist
//! is `null`, never a number that stands for infinity. Next file to read: [`super::gather`].

use nalgebra::DMatrix;
use serde::Serialize;

use super::ensemble::Row;
use super::series::Series;
use crate::constants::HangsOn;

/// One parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterInfo {
    /// Name in the estimated vector, such as `R` or `R[in-vivo-1]`.
    pub name: String,
    /// Unit label of `value`.
    pub unit: String,
    /// Transform of its prior.
    pub transform: &'static str,
    /// Value at which the sensitivities were taken, in physical units.
    pub value: f64,
    /// Root of the summed squares of its sensitivities, in noise sd per transformed unit.
    pub sensitivity_norm: f64,
    /// Posterior sd to be expected from data and prior.
    pub expected_sd: f64,
    /// Prior sd.
    pub prior_sd: f64,
    /// Sd by the data alone; `null` when they do not determine the parameter.
    pub standard_error: Option<f64>,
    /// Share of the prior sd that the data take away: 1 − expected sd / prior sd.
    pub informed: f64,
    /// Information gained about the parameter, log₂(prior sd / expected sd), in bit.
    pub information_bits: f64,
    /// The expected sd in physical units, to first order.
    pub expected_sd_physical: f64,
    /// The prior sd in physical units, to first order.
    pub prior_sd_physical: f64,
    /// Expected central 95 % interval around `value`, in physical units.
    pub expected_interval95: [f64; 2],
    /// Prior central 95 % interval, in physical units.
    pub prior_interval95: [f64; 2],
    /// Prior median, in physical units.
    pub prior_median: f64,
}

/// Parameters and their collinearity index.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubsetInfo {
    /// Names.
    pub parameters: Vec<String>,
    /// Collinearity index, at least 1; `null` when the sensitivities are linearly dependent.
    pub index: Option<f64>,
}

/// Near linear dependence of the sensitivities (Brun, Reichert & Künsch 2001).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CollinearityInfo {
    /// Index of all parameters together; `null` when the sensitivities are linearly dependent.
    pub index: Option<f64>,
    /// The parameters it is taken over: those that change a prediction.
    pub parameters: Vec<String>,
    /// Every pair, and of few parameters every triple; the worst first, pairs before triples.
    pub subsets: Vec<SubsetInfo>,
    /// A well conditioned subset of every size up to 40, found by adding one parameter at a time.
    pub growing: Vec<SubsetInfo>,
}

/// A combination of parameters, and how well it is known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DirectionInfo {
    /// The combination in words, coefficients per prior sd of each parameter: `E3 − 0.9 k_s`.
    pub combination: String,
    /// All coefficients, in the order of the parameters.
    pub coefficients: Vec<f64>,
    /// Parameters that take part, the largest first.
    pub parameters: Vec<String>,
    /// Expected sd over prior sd of the combination.
    pub share: f64,
    /// Sd of the combination as it is written, by the data alone, in `unit`; `null` without information.
    pub standard_error: Option<f64>,
    /// Unit of that: `octaves`, `ln`, or `prior sd` where the parameters have different scales.
    pub unit: &'static str,
}

/// Where a record stands among the times of the curves.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RecordSteps {
    /// Record name.
    pub record: String,
    /// First of its times.
    pub first: usize,
    /// Number of its times.
    pub n: usize,
}

/// The result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identification {
    /// Study name.
    pub study: String,
    /// Model kind.
    pub model: String,
    /// Where the sensitivities were taken.
    pub at: String,
    /// One entry per estimated parameter.
    pub parameters: Vec<ParameterInfo>,
    /// Correlation of the errors by the data alone, row by row; `null` where there is none.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Correlation to be expected of the posterior, prior included.
    pub posterior_correlation: Vec<Vec<f64>>,
    /// Fisher information of the data, per transformed units.
    pub information: Vec<Vec<f64>>,
    /// Near linear dependence.
    pub collinearity: CollinearityInfo,
    /// As many combinations as parameters, the least informed first.
    pub directions: Vec<DirectionInfo>,
    /// Generalised sensitivity functions (Thomaseth & Cobelli 1999); `null` for a parameter that the data do not determine.
    pub gsf: Series,
    /// Change of the predictions at each time, in noise sd per prior sd of the parameter.
    pub sensitivity: Series,
    /// Which of the times belong to which record.
    pub records: Vec<RecordSteps>,
    /// Names of the parameters that change no observed prediction.
    pub silent: Vec<String>,
    /// How far an estimate would follow the constants of the model.
    pub hangs_on: HangsOn,
    /// Observed values.
    pub n_obs: usize,
    /// Runs of the model.
    pub runs: u64,
    /// Workers that answered.
    pub workers: usize,
    /// Distance of the runs from the point, in prior sd.
    pub spread: f64,
    /// Unit of the times.
    pub time_unit: String,
    /// What the figures are conditional on.
    pub conditional_on: String,
    /// What to do, in a sentence or two.
    pub advice: String,
    /// What the reader must know before using the numbers.
    pub warnings: Vec<String>,
    /// The observed values, for the table of sensitivities.
    #[serde(skip)]
    pub rows: Vec<Row>,
    /// Sensitivities of the rows, in noise sd per transformed unit.
    #[serde(skip)]
    pub whitened: DMatrix<f64>,
    /// Output names.
    #[serde(skip)]
    pub outputs: Vec<String>,
}
