//! One trial run of every record at the prior median: whether the model runs where the study starts.
//!
//! It is made in this process, or by the workers where nothing of the model may run here or its states are large. Next files to read:
//! [`mod@dry_run`], which makes the runs of a fit, [`mod@asked`], which asks for what `[predict]` names, and [`on_fleet`].

mod asked;
pub mod dry_run;
pub mod on_fleet;
mod remedy;
pub(crate) mod rounding;

use std::sync::Arc;

use starlings_fleet::{Held, ProtocolError, returns, travels};
use starlings_models::external::table::foreign_bytes;
use starlings_models::{Forward, Job, ParticleError, Prediction, SOLVER, SetupError, Stop, Until, Window};
use starlings_proto::spent::spent;

use super::{Study, posterior};
pub use dry_run::{Depth, dry_run};
pub use on_fleet::{FleetTrialError, trial_on_fleet};

/// The result of the trial for one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialChannel {
    /// Record name.
    pub record: String,
    /// Output name.
    pub output: String,
    /// Number of observed values.
    pub n_obs: usize,
    /// Root mean square of observed − predicted at the prior median.
    pub rmse: f64,
    /// Noise sd.
    pub noise: f64,
    /// Whether the model may have rounded the output.
    pub looks_rounded: bool,
}

/// Why the trial failed.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// The setup does not build.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The model fails at the prior median.
    #[error("the model fails at the prior median on record `{record}` ({values}): {source}; {remedy}")]
    Model {
        /// Record name.
        record: String,
        /// The values it was run with.
        values: String,
        /// Why it failed.
        source: ParticleError,
        /// What to do.
        remedy: String,
    },
    /// The whole record runs, and a run of the fit does not.
    #[error(
        "the model fails at the prior median on record `{record}` in a run of the fit, {span} ({values}): {source}"
    )]
    Fit {
        /// Record name.
        record: String,
        /// What is run, such as `over the training span alone, 0 to 48`.
        span: String,
        /// The values it was run with.
        values: String,
        /// Why it failed.
        source: ParticleError,
    },
    /// What the study measures runs, and what it predicts does not.
    #[error(
        "{outputs} of `[predict]` cannot be predicted: a run over record `{record}` at the prior median fails that asks for nothing \
         else ({values}): take out of `outputs` in `[predict]` what the model does not give, or make it give that: {source}"
    )]
    Predict {
        /// What is predicted, in quotes.
        outputs: String,
        /// Record name.
        record: String,
        /// The values it was run with.
        values: String,
        /// Why it failed.
        source: ParticleError,
    },
    /// The numbers are no table of 64-bit floats with a row per time.
    #[error(
        "the answer of the model on record `{record}` is no table with a row per time: {what}; `starlings conformance` tells more"
    )]
    Table {
        /// Record name.
        record: String,
        /// What it is instead.
        what: String,
    },
    /// Coordinator and workers could not send it to each other.
    #[error(
        "a run of record `{record}` cannot travel between coordinator and workers: {source}; a coarser model has a smaller state, and \
         a solver that declares no states keeps them to itself (estimator kind \"batch\")"
    )]
    Travel {
        /// Record name.
        record: String,
        /// What is too large.
        source: ProtocolError,
    },
    /// Model and data are so far apart that the square of their difference is no number.
    #[error(
        "`{output}` of record `{record}` and its prediction at the prior median are out of all proportion: {remedy}"
    )]
    Misfit {
        /// Record name.
        record: String,
        /// Output name.
        output: String,
        /// What to do.
        remedy: String,
    },
}

/// Runs every record once, free, at the prior median; none where the model cannot be run in this process.
///
/// # Errors
/// When the setup does not build or the model fails.
pub fn trial(study: &Study) -> Result<Vec<TrialChannel>, TrialError> {
    if !study.runs_here {
        return Ok(Vec::new());
    }
    trial_by(study, &Here(&*study.solver_host.build(&study.setup)?))
}

/// Who makes the runs of a trial. A large state stays where it is held.
trait Runner {
    /// Makes one run.
    ///
    /// # Errors
    /// When it gives no prediction.
    fn run(&self, job: Job<Held>) -> Result<Prediction<Held>, ParticleError>;
}

/// A model in this process.
struct Here<'a>(&'a dyn Forward);

impl Runner for Here<'_> {
    fn run(&self, job: Job<Held>) -> Result<Prediction<Held>, ParticleError> {
        let lost = |error: starlings_fleet::StateError| ParticleError::Infrastructure(error.to_string());
        let job = job.try_map(Held::for_model).map_err(lost)?;
        let until = Until { spent: &spent(), stop: &Stop::default(), traceparent: None };
        self.0.run_within(&job, &until)?.try_map(|state| Ok(state.into()))
    }
}

/// The trial by whoever makes the runs.
fn trial_by(study: &Study, model: &dyn Runner) -> Result<Vec<TrialChannel>, TrialError> {
    let prior = posterior::prior(study);
    let mut channels = Vec::new();
    for (index, record) in study.records.iter().enumerate() {
        let window = Arc::new(study.whole(index, false));
        let theta = study.theta_for(index, prior.mean.as_slice());
        let ran = run(model, index, &window, &theta, None);
        let mut prediction = ran.map_err(|fault| match fault {
            Fault::Run(source) => {
                let (values, remedy) = (named(study, &theta), remedy::failure(study, &source, &window));
                TrialError::Model { record: record.name.clone(), values, source, remedy }
            }
            Fault::Travel(source) => TrialError::Travel { record: record.name.clone(), source },
        })?;
        check_bytes(study, &record.name, &prediction)?;
        let n_obs = study.setup.outputs.len();
        let looks_rounded = rounding::of_outputs(study, &prediction.outputs);
        study.measure(index, &window.times, &mut prediction.outputs);
        for channel in &record.channels {
            let residuals: Vec<f64> = window
                .times
                .iter()
                .enumerate()
                .filter_map(|(j, t)| {
                    Some(record.observed(channel, *t)? - prediction.outputs[j * n_obs + channel.row])
                })
                .collect();
            let sum: f64 = residuals.iter().map(|r| r * r).sum();
            if !sum.is_finite() {
                let (record, output) = (record.name.clone(), channel.output.clone());
                return Err(TrialError::Misfit { record, output, remedy: remedy::misfit(study) });
            }
            channels.push(TrialChannel {
                record: record.name.clone(),
                output: channel.output.clone(),
                n_obs: residuals.len(),
                rmse: (sum / residuals.len().max(1) as f64).sqrt(),
                noise: channel.noise,
                looks_rounded: looks_rounded[channel.row],
            });
        }
    }
    Ok(channels)
}

/// Why a run of a trial failed.
enum Fault {
    Run(ParticleError),
    Travel(ProtocolError),
}

/// One run; wherever it is made, its job and prediction must fit the protocol to workers.
fn run(
    model: &dyn Runner,
    record: usize,
    window: &Arc<Window>,
    theta: &[f64],
    state: Option<Held>,
) -> Result<Prediction<Held>, Fault> {
    let job =
        Job { particle: 0, record: record as u32, window: Arc::clone(window), theta: theta.to_vec(), state };
    travels(&job).map_err(Fault::Travel)?;
    let prediction = model.run(job).map_err(Fault::Run)?;
    returns(&prediction).map_err(Fault::Travel)?;
    Ok(prediction)
}

/// Refuses what a program of its own sent in other bytes than those of 64-bit floats.
fn check_bytes(study: &Study, record: &str, prediction: &Prediction<Held>) -> Result<(), TrialError> {
    if study.setup.model.kind != SOLVER {
        return Ok(());
    }
    foreign_bytes(&prediction.outputs).map_or(Ok(()), |value| {
        let what = format!("values such as {value:e} are the bytes of integers, or in another byte order");
        Err(TrialError::Table { record: record.to_owned(), what })
    })
}

/// Names and values of a job's parameters.
pub(super) fn named(study: &Study, theta: &[f64]) -> String {
    // A median that went through a logarithm and back is itself but for the last digits.
    let short = |value: &f64| format!("{value:.12e}").parse::<f64>().unwrap_or(*value);
    let pairs =
        study.setup.parameters.iter().zip(theta).map(|(name, value)| format!("{name} = {}", short(value)));
    pairs.collect::<Vec<_>>().join(", ")
}
