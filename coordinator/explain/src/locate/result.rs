//! What locating finds, as plain data for the explanation, the report and the JSON.
//!
//! Next file to read: [`super`].

use serde::{Deserialize, Serialize};

/// A signal of the model along every record, at the record's times: an input, a state or an output of the fitted model.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Name.
    pub name: String,
    /// Unit label.
    pub unit: String,
    /// Values by record, one per time of the record.
    pub values: Vec<Vec<f64>>,
}

impl Track {
    /// Smallest and largest value over all records; infinite, the larger first, where there is none.
    pub(crate) fn ends(&self) -> [f64; 2] {
        ends(self.values.iter().flatten().copied())
    }

    /// Slope at a step of a record, from the neighbours in time, one-sided at the ends; `None` beyond them.
    pub(crate) fn slope(&self, record: usize, step: usize, times: &[f64]) -> Option<f64> {
        let values = self.values.get(record)?;
        let last = values.len().min(times.len()).checked_sub(1)?;
        let (before, after) = (step.saturating_sub(1), (step + 1).min(last));
        (step <= last && after > before)
            .then(|| (values[after] - values[before]) / (times[after] - times[before]))
    }
}

/// Smallest and largest of the finite values; infinite, the larger first, where there is none.
pub(super) fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values
        .filter(|v| v.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)])
}

/// Everything that locating found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Located {
    /// Where simulation and data disagree, worst first.
    pub places: Vec<MisfitPlace>,
    /// The misfit of every channel of every record.
    pub channels: Vec<ChannelGap>,
    /// Residuals over operating regions.
    pub maps: Vec<RegionMap>,
    /// Signals with which the residuals correlate, strongest first.
    pub correlations: Vec<Correlated>,
    /// Residuals by frequency.
    pub spectra: Vec<ResidualSpectrum>,
    /// The unknown input of each equation that would remove the residuals.
    pub forces: Vec<UnknownInput>,
}

/// A place where simulation and data disagree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MisfitPlace {
    /// Output name.
    pub channel: String,
    /// Unit label of the channel.
    pub unit: String,
    /// Start of the span.
    pub from: f64,
    /// End of the span.
    pub to: f64,
    /// The operating region in words, such as `flow > 50 mL/s`; empty for all of the span.
    pub region: String,
    /// Root mean square of observed − predicted there.
    pub rmse: f64,
    /// Its block-bootstrap 95 % interval.
    pub interval95: [f64; 2],
    /// What noise and the uncertainty of the fit would leave there.
    pub expected: f64,
    /// One sentence with the numbers.
    pub sentence: String,
}

/// The misfit of one channel of one record in one use.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelGap {
    /// Record name.
    pub record: String,
    /// Output name.
    pub channel: String,
    /// Unit label.
    pub unit: String,
    /// `train`, `held-out` or `held-out-channel`.
    #[serde(rename = "use")]
    pub usage: String,
    /// Values.
    pub n: usize,
    /// Noise sd.
    pub noise: f64,
    /// Root mean square residual.
    pub rmse: f64,
    /// Its block-bootstrap 95 % interval.
    pub interval95: [f64; 2],
    /// Mean residual.
    pub bias: f64,
    /// Autocorrelation of the residuals at lag 1.
    pub lag1: f64,
    /// Probability of residuals at least as autocorrelated if they were white (Ljung & Box 1978).
    pub whiteness_p: f64,
    /// Number of independent values that the residuals amount to.
    pub effective_n: f64,
}

/// Residuals of one channel over bins of one or two signals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionMap {
    /// Output name.
    pub channel: String,
    /// Unit label of the channel.
    pub unit: String,
    /// Noise sd of the channel.
    pub noise: f64,
    /// Signal along the bins' first axis, and its unit.
    pub x: (String, String),
    /// Signal along the second axis, and its unit; `None` for bins of one signal.
    pub y: Option<(String, String)>,
    /// Bin edges along the first axis, n_x + 1.
    pub x_edges: Vec<f64>,
    /// Bin edges along the second axis, n_y + 1; empty for bins of one signal.
    pub y_edges: Vec<f64>,
    /// Values per bin, `count[j * n_x + i]`.
    pub count: Vec<usize>,
    /// Mean residual per bin; `None` where there is no value.
    pub bias: Vec<Option<f64>>,
    /// Root mean square residual per bin.
    pub rmse: Vec<Option<f64>>,
    /// Share of the residuals' variance that the bins' means account for, corrected for the number of bins.
    pub explained: f64,
}

/// A signal with which the residuals of a channel correlate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Correlated {
    /// Output name.
    pub channel: String,
    /// The signal in words, such as `flow`, `rate of flow`, `flow 0.05 s earlier`, `sign of v`.
    pub with: String,
    /// Correlation coefficient.
    pub coefficient: f64,
    /// Its 95 % interval with the effective sample size.
    pub interval95: [f64; 2],
}

/// Residuals of one channel by frequency.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResidualSpectrum {
    /// Record name.
    pub record: String,
    /// Output name.
    pub channel: String,
    /// Frequencies, per time unit.
    pub frequency: Vec<f64>,
    /// Power density over that of white noise of the channel's sd.
    pub power_over_noise: Vec<f64>,
    /// Frequency with the largest power.
    pub peak: f64,
}

/// The unknown input of one equation, as a random walk estimated by the filter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnknownInput {
    /// State whose equation it was added to.
    pub state: String,
    /// Unit label: the state's per time unit.
    pub unit: String,
    /// Record name.
    pub record: String,
    /// Times.
    pub time: Vec<f64>,
    /// Estimate.
    pub value: Vec<f64>,
    /// Its sd.
    pub sd: Vec<f64>,
    /// The state along the run, to plot the input against.
    pub at: Vec<f64>,
    /// All scalar states along that run, by name, which the input and the data keep near what was measured.
    #[serde(skip)]
    pub states: Vec<(String, Vec<f64>)>,
    /// Log-likelihood gained over the model without it.
    pub log_likelihood_gain: f64,
    /// What the effects that were added give along the same run; empty where they add nothing to this equation.
    #[serde(default)]
    pub proposed: Vec<f64>,
}
