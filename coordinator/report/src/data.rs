//! What a report shows: plain data, filled by the reader of the store and by nothing else; how it was computed is absent.
//!
//! A report made again from an old run folder is the same report. Every number has the unit that its row or channel names;
//! times are in [`ReportData::time_unit`] unless the field says seconds. What is not finite is missing. Next: `page.rs`.

mod parameter;

use serde::{Deserialize, Serialize};

pub(crate) use parameter::ParameterRow;
use starlings_study::predicted::{PredictedCourse, PredictedOutput};

/// Everything one report shows.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReportData {
    /// Name of the study.
    pub study: String,
    /// Name of the forward model.
    pub(crate) model: String,
    /// What the study says about itself.
    pub(crate) says: Option<String>,
    /// The estimator and its settings, on one line.
    pub(crate) estimator: String,
    /// Seed from which every random choice derives.
    pub(crate) seed: u64,
    /// Unit of every time that is not said to be in seconds.
    pub(crate) time_unit: String,
    /// When the run started, as text.
    pub(crate) started: Option<String>,
    /// Wall-clock time of the run, s.
    pub(crate) wall_s: f64,
    /// The result in one sentence; when absent it is made from the parameters.
    pub(crate) headline: Option<String>,
    /// What a reader must know before any number; shown before everything else.
    pub warnings: Vec<String>,
    /// One row per estimated parameter, in the order of the study.
    pub(crate) parameters: Vec<ParameterRow>,
    /// The intervals given the residuals come first, because they are much wider than those at the stated noise.
    pub(crate) residuals_first: bool,
    /// Posterior correlation of the parameters, n_param rows of n_param values, in the order of `parameters`.
    pub(crate) correlation: Vec<Vec<f64>>,
    /// Families of numbered parameters of one unit, such as E1 to E5, in the order of their numbers.
    pub(crate) families: Vec<Family>,
    /// What the observer does for the state; `None` without one.
    pub(crate) observer: Option<ObserverRow>,
    /// Which constants the estimates hang on.
    pub(crate) hangs_on: Option<starlings_study::constants::HangsOn>,
    /// One per parameter: how its estimate moved during the run.
    pub(crate) tracks: Vec<Track>,
    /// What the horizontal axis of the tracks is, with its unit.
    pub(crate) x_label: String,
    /// One per record and observed output.
    pub(crate) channels: Vec<ChannelPlot>,
    /// What was predicted besides, measured or not.
    pub(crate) predicted: Vec<PredictedCourse>,
    /// The same in numbers.
    pub(crate) predictions: Vec<PredictedOutput>,
    /// One per record and observed output, of the residuals.
    pub(crate) autocorrelation: Vec<Autocorrelation>,
    /// Normalised innovation squared, one series per pass.
    pub(crate) nis: Vec<NisSeries>,
    /// Mean over the last pass of the normalised innovation squared per observed value; 1 is expected.
    pub(crate) nis_per_observation: Option<f64>,
    /// Innovation log-likelihood of the last pass, natural logarithm.
    pub(crate) log_likelihood: Option<f64>,
    /// What the fleet did.
    pub(crate) fleet: FleetTable,
    /// What the intervals are conditional on, in one or more sentences.
    pub(crate) conditional_on: String,
    /// The command that makes this run again.
    pub(crate) command: String,
    /// Version of the program that made the run.
    pub(crate) version: String,
}

/// Parameters that differ by a number alone.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Family {
    /// What their names begin with.
    pub(crate) stem: String,
    /// Number of each and its row of [`ReportData::parameters`].
    pub(crate) members: Vec<(u32, usize)>,
    /// They are stiffnesses of the regions of a vessel.
    pub(crate) stiffness: bool,
}

/// Innovations with the observer and without it, in noise standard deviations.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ObserverRow {
    /// Kind of the observer.
    pub(crate) kind: String,
    /// Its gain, in 1/time unit.
    pub(crate) gain: f64,
    /// Root mean square over the training spans with the observer.
    pub(crate) with: f64,
    /// The same without it.
    pub(crate) without: f64,
    /// Their course, one per record.
    pub(crate) courses: Vec<ObserverPlot>,
}

/// Root mean square innovation over the channels at every time of one record; the three vectors have equal length.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ObserverPlot {
    /// Name of the record.
    pub(crate) record: String,
    /// Observation times.
    pub(crate) time: Vec<f64>,
    /// With the observer, in noise standard deviations.
    pub(crate) with: Vec<f64>,
    /// Without it.
    pub(crate) without: Vec<f64>,
}

/// How one parameter's estimate moved.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Track {
    /// Name of the parameter.
    pub(crate) name: String,
    /// Unit; empty for a pure number.
    pub(crate) unit: String,
    /// Prior median, drawn as a line.
    pub(crate) prior_median: f64,
    /// Draw the value on a logarithmic axis (a parameter estimated through its logarithm).
    pub(crate) log_axis: bool,
    /// One per pass, in order; the last is the result.
    pub(crate) passes: Vec<PassTrack>,
}

/// One pass of one parameter; the four vectors have equal length.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct PassTrack {
    /// Number of the pass, from 1.
    pub(crate) pass: usize,
    /// Times or iterations.
    pub(crate) time: Vec<f64>,
    /// Estimate.
    pub(crate) estimate: Vec<f64>,
    /// Estimate − 2 sd, in the parameter's own scale.
    pub(crate) lo: Vec<f64>,
    /// Estimate + 2 sd, in the parameter's own scale.
    pub(crate) hi: Vec<f64>,
}

/// One observed output of one record, free run with the final estimate; the four vectors have equal length.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ChannelPlot {
    /// Name of the record.
    pub(crate) record: String,
    /// Name of the channel.
    pub(crate) channel: String,
    /// Unit of the channel; empty for a pure number.
    pub(crate) unit: String,
    /// Times of observation.
    pub(crate) time: Vec<f64>,
    /// Measured values; `None` where the recording has none.
    pub(crate) observed: Vec<Option<f64>>,
    /// Prediction with the final estimate.
    pub(crate) predicted: Vec<f64>,
    /// Standard deviations of the prediction that the uncertainty of the parameters makes; `None` where it is not known.
    pub(crate) spread: Vec<Option<f64>>,
    /// Standard deviation of the measurement noise, in the channel's unit.
    pub(crate) noise: f64,
    /// First and last time of the training span; `None` when no time of this record was fitted.
    pub(crate) train: Option<[f64; 2]>,
    /// The channel was never fitted.
    pub(crate) held_out_channel: bool,
    /// Root mean square residual on the training span.
    pub(crate) train_rmse: Option<f64>,
    /// Root mean square residual on everything that was held out.
    pub(crate) held_out_rmse: Option<f64>,
}

/// Sample autocorrelation of the residuals of one channel; the two vectors have equal length.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Autocorrelation {
    /// Name of the record.
    pub(crate) record: String,
    /// Name of the channel.
    pub(crate) channel: String,
    /// Lags, in the study's time unit.
    pub(crate) lag_time: Vec<f64>,
    /// Autocorrelation at each lag, in [−1, 1].
    pub(crate) value: Vec<f64>,
    /// Half-width of the 95 % band of white noise, 1.96/√n.
    pub(crate) band: f64,
}

/// Normalised innovation squared over one pass; the vectors have equal length.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct NisSeries {
    /// Number of the pass, from 1.
    pub(crate) pass: usize,
    /// Times or iterations.
    pub(crate) time: Vec<f64>,
    /// Normalised innovation squared divided by the number of values used; 1 is expected.
    pub(crate) nis_per_observation: Vec<f64>,
    /// Lower end of the 95 % band of chi-square per observation, for the values used in each analysis.
    pub(crate) lo: Vec<f64>,
    /// Upper end of that band.
    pub(crate) hi: Vec<f64>,
    /// Observed values used in each analysis.
    pub(crate) n_used: Vec<usize>,
}

/// What the fleet did during the run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct FleetTable {
    /// One row per worker, in order of joining.
    pub(crate) workers: Vec<WorkerRow>,
    /// Model runs that the fit asked for.
    pub(crate) runs_total: u64,
    /// Runs beside those: at the estimate, and for intervals and predictions.
    pub(crate) runs_after: u64,
    /// Runs that failed for good.
    pub(crate) failed: u64,
    /// Attempts beyond the first of a run.
    pub(crate) retried: u64,
    /// Sigma points that were pulled towards the mean and run again.
    pub(crate) rescued: u64,
    /// Duration of one run; `None` when nothing was timed.
    pub(crate) time_per_run: Option<RunTimes>,
    /// Joins, losses and failures, in order of time.
    pub(crate) events: Vec<FleetEvent>,
}

/// One worker of the run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct WorkerRow {
    /// Name under which the worker joined.
    pub(crate) name: String,
    /// Host it ran on.
    pub(crate) host: String,
    /// Jobs it answered.
    pub(crate) jobs: u64,
    /// Runs that failed on it for good.
    pub(crate) failed: u64,
    /// Mean duration of one job, s.
    pub(crate) mean_s: f64,
    /// Share of the run's wall time that its slots computed, 0 to 1; `None` when wall time or slots are not known.
    pub(crate) busy_share: Option<f64>,
}

/// Duration of one model run, s.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct RunTimes {
    /// Shortest.
    pub(crate) min: f64,
    /// Median.
    pub(crate) median: f64,
    /// 95th percentile.
    pub(crate) p95: f64,
    /// Longest.
    pub(crate) max: f64,
    /// Histogram, bins in ascending order.
    pub(crate) bins: Vec<RunTimeBin>,
}

/// One bin of the histogram of run times.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct RunTimeBin {
    /// Lower edge, s.
    pub(crate) from: f64,
    /// Upper edge, s.
    pub(crate) to: f64,
    /// Runs in the bin.
    pub(crate) count: u64,
}

/// Something that happened on the fleet.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct FleetEvent {
    /// Time since the start of the run, s.
    pub(crate) time_s: f64,
    /// What happened.
    pub(crate) text: String,
}
