//! One particle's run over one window of data: what a worker receives and what it returns.
//!
//! No scheduling and no wire format here. Next file to read: [`crate::simulator`], which runs a job on a [`crate::Model`].

use std::sync::Arc;

use crate::Spec;

/// A sampled signal, linear between its samples and constant beyond them.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Sample times, strictly increasing, in the study's time unit.
    pub times: Vec<f64>,
    /// Sample values, as many as times.
    pub values: Vec<f64>,
}

/// One span of one record: when to predict, what was observed there, and the inputs that drive the model across it.
///
/// Window k starts where window k−1 ended. The first window of a record may have `start == times[0]`: the initial state is
/// then observed without a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Time at which the run starts, in the study's time unit.
    pub start: f64,
    /// Observation times, increasing, `times[0] >= start`; the run ends at the last one.
    pub times: Vec<f64>,
    /// Observed values, `n_obs × n_times`, one column per time: `observed[j * n_obs + i]`. NaN where nothing was measured
    /// or where the value is held out.
    pub observed: Vec<f64>,
    /// Input signals in the order of the model's inputs, covering `[start, end]` (and earlier where a delay asks for it).
    pub inputs: Vec<Signal>,
}

/// One run: this particle, these parameters, this window, from this state.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Index of the sigma point.
    pub particle: u32,
    /// Index of the record in the study.
    pub record: u32,
    /// The window, shared by all particles.
    pub window: Arc<Window>,
    /// Parameter values in physical units, in the order of [`crate::Setup::parameters`].
    pub theta: Vec<f64>,
    /// State at `window.start`; `None` starts from the model's initial state.
    pub state: Option<Vec<f64>>,
}

/// What a run predicts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prediction {
    /// Predicted outputs, `n_obs × n_times`, laid out as [`Window::observed`]; recorded before any correction.
    pub outputs: Vec<f64>,
    /// State at the window's end, after the observer's correction.
    pub state: Vec<f64>,
    /// Wall time of the run in seconds, measured by the worker; zero from a bare model, which knows no clock.
    pub cost: f64,
}

/// Why one particle's run gave no prediction. A failure is data: the fleet retries it, the study pulls it in.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParticleError {
    /// A state or output stopped being a finite number.
    #[error("{what} is not a finite number at t = {time}")]
    NotFinite {
        /// The state or output.
        what: String,
        /// Time in the study's unit.
        time: f64,
    },
    /// The integrator could not go on with a positive step.
    #[error(
        "the integrator's step fell to {step:e} at t = {time}: the model is too stiff for it or has a singularity there"
    )]
    StepTooSmall {
        /// Time in the study's unit.
        time: f64,
        /// The refused step.
        step: f64,
    },
    /// The run would take more steps than allowed: a step, a delay or a time constant is too short for it.
    #[error("more than {limit} steps of integration, at t = {time}")]
    TooManySteps {
        /// Time reached.
        time: f64,
        /// The limit.
        limit: u64,
    },
    /// The job does not fit the setup: a wrong length or an unknown record.
    #[error("the job does not fit the model: {0}")]
    BadJob(String),
    /// The run panicked or its process failed.
    #[error("the solver failed: {0}")]
    Solver(String),
    /// No worker could finish the run; the text lists what happened at each attempt.
    #[error("given up after {attempts} attempt{}: {reason}", if *attempts == 1 { "" } else { "s" })]
    Lost {
        /// How often it was tried.
        attempts: u32,
        /// What happened at the last attempt.
        reason: String,
    },
}

/// What a worker runs. Native models and every adapter to an external solver implement it. Same job, same bits.
pub trait Forward: Send + Sync {
    /// What the model says of itself, effects included.
    fn spec(&self) -> &Spec;

    /// Runs one job.
    ///
    /// # Errors
    /// When the run gives no usable prediction; the caller treats it as data.
    fn run(&self, job: &Job) -> Result<Prediction, ParticleError>;
}
