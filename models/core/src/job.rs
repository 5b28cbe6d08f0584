//! One particle's run over one window of data: what a worker receives and what it returns.
//!
//! No scheduling and no wire format here. Next files to read: [`crate::failure`] for why there may be no prediction,
//! [`crate::simulator`], which runs a job on a [`crate::Model`].

use std::sync::Arc;

use crate::{ParticleError, Spec, StateValues, Until};

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
    /// Per output row the time of its last observed value before `start`, or the start of the record; empty: `start` for all. An
    /// observer corrects by a value as strongly as the time since the one before it of the same row asks.
    pub since: Vec<f64>,
}

impl Window {
    /// A window in which nothing is observed: the model runs freely to `times`, with `n_obs` output rows at each.
    pub fn free(start: f64, times: Vec<f64>, n_obs: usize, inputs: Vec<Signal>) -> Self {
        Self { start, observed: vec![f64::NAN; n_obs * times.len()], times, inputs, since: Vec::new() }
    }
}

/// One run: this particle, these parameters, this window, from this state.
///
/// A model gets the values of the state; on its way to a worker a large state may stand as something else, `S`.
#[derive(Clone, Debug, PartialEq)]
pub struct Job<S = StateValues> {
    /// Index of the sigma point.
    pub particle: u32,
    /// Index of the record in the study.
    pub record: u32,
    /// The window, shared by all particles.
    pub window: Arc<Window>,
    /// Parameter values in physical units, in the order of [`crate::Setup::parameters`].
    pub theta: Vec<f64>,
    /// State at `window.start`; `None` starts from the model's initial state.
    pub state: Option<S>,
}

impl<S> Job<S> {
    /// The same job with its state as something else.
    pub fn map<T>(self, change: impl FnOnce(S) -> T) -> Job<T> {
        let Self { particle, record, window, theta, state } = self;
        Job { particle, record, window, theta, state: state.map(change) }
    }

    /// The same job with its state as something else.
    ///
    /// # Errors
    /// What `change` says.
    pub fn try_map<T, E>(self, change: impl FnOnce(S) -> Result<T, E>) -> Result<Job<T>, E> {
        let Self { particle, record, window, theta, state } = self;
        Ok(Job { particle, record, window, theta, state: state.map(change).transpose()? })
    }
}

/// What a run predicts. Its state is an `S` as that of a [`Job`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prediction<S = StateValues> {
    /// Predicted outputs, `n_obs × n_times`, laid out as [`Window::observed`]; recorded before any correction.
    pub outputs: Vec<f64>,
    /// State at the window's end, after the observer's correction.
    pub state: S,
    /// Wall time of the run in seconds, measured by the worker; zero from a bare model, which knows no clock.
    pub cost: f64,
}

impl<S> Prediction<S> {
    /// The same prediction with its state as something else.
    ///
    /// # Errors
    /// What `change` says.
    pub fn try_map<T, E>(self, change: impl FnOnce(S) -> Result<T, E>) -> Result<Prediction<T>, E> {
        let Self { outputs, state, cost } = self;
        Ok(Prediction { outputs, state: change(state)?, cost })
    }
}

/// What a worker runs. Native models and every adapter to an external solver implement it. Same job, same bits.
pub trait Forward: Send + Sync {
    /// What the model says of itself, effects included.
    fn spec(&self) -> &Spec;

    /// Runs one job.
    ///
    /// # Errors
    /// When the run gives no usable prediction; only a model failure among them is data about the parameters.
    fn run(&self, job: &Job) -> Result<Prediction, ParticleError>;

    /// Runs one job, which may take as long as its setup says and its caller wants it. What runs in a program of its own is timed by
    /// whoever started the program. A run that was stopped ends with any error.
    ///
    /// # Errors
    /// As [`Forward::run`], and [`ParticleError::Timeout`].
    fn run_within(&self, job: &Job, until: &Until<'_>) -> Result<Prediction, ParticleError> {
        let _ = until;
        self.run(job)
    }
}
