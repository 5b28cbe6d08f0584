//! A twin experiment: the study's model run forward with chosen values and noise, to make data whose truth is known.
//!
//! Nothing is estimated and no fleet is needed. The noise of every output is a ChaCha8 stream of its own, so adding an
//! output changes no other's data. Next files to read: [`run`], and [`starlings_models::periodic`] for a start in the periodic state.

mod noise;
mod run;

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_models::effect::library::library_in;
use starlings_models::{BuildSetup, ObserverDef, ParticleError, Setup, SetupError, Window, nearest};

use super::check::relative::relative;
use super::check::scales::{CourseError, Ruler, Trial};
use super::field::components;
use super::{Study, posterior};
use crate::twin::run::Run;

/// What to simulate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Twin {
    /// Record whose times and inputs are used.
    pub record: usize,
    /// Values by name: parameters, constants, `initial:<state>` or effect parameters. What is not named stands at its prior
    /// median or default.
    pub values: Vec<(String, f64)>,
    /// Amplitudes of effects by effect name; an effect of the built-in list is added to the model.
    pub effects: Vec<(String, f64)>,
    /// Standard deviation of the noise added to every output, in the output's unit.
    pub noise: f64,
    /// Noise added on top to every output that the study observes: its standard deviation as a share of the output's
    /// largest amplitude, the difference of highest and lowest value over time, over all components of a field.
    pub noise_share: f64,
    /// Seed of the noise, that of the outputs and that of the model itself.
    pub seed: u64,
    /// Times at which the outputs are wanted; empty takes the record's.
    pub times: Vec<f64>,
    /// Starts from the periodic state of the record's first period of this length instead of the initial state. Inputs that
    /// end before `times` do go on periodically.
    pub period: Option<f64>,
}

/// A simulated recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Times.
    pub times: Vec<f64>,
    /// Column names: outputs, then inputs.
    pub columns: Vec<String>,
    /// Values, one vector per column.
    pub values: Vec<Vec<f64>>,
    /// Standard deviation of the noise that was added, by output; a field counts as one.
    pub noise: Vec<(String, f64)>,
    /// The state at the record's start, by component; empty from a model that cannot restart from one.
    pub start: Vec<(String, f64)>,
    /// Periods that were run to find a periodic start.
    pub n_period: Option<usize>,
}

/// Why nothing was simulated.
#[derive(Debug, thiserror::Error)]
pub enum TwinError {
    /// A name or value that does not fit the model.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The model failed.
    #[error("the model fails with these values: {0}")]
    Model(#[from] ParticleError),
    /// Anything else that was asked wrongly.
    #[error("{0}")]
    Request(String),
}

/// Runs the twin.
///
/// # Errors
/// When a name is unknown, a time lies before the record, the model fails, or there is no periodic start.
pub fn simulate(study: &Study, twin: &Twin) -> Result<Recording, TwinError> {
    let record = study
        .records
        .get(twin.record)
        .ok_or_else(|| TwinError::Request(format!("the study has {} records", study.records.len())))?;
    let (mut setup, theta) = place(study, twin)?;
    if twin.period.is_some() {
        setup.periods.clear();
    }
    let model = study.solver_host.build(&setup)?;
    let times = if twin.times.is_empty() { record.times.clone() } else { twin.times.clone() };
    let start = record.start;
    if times.first().is_some_and(|t| *t < start) || times.windows(2).any(|w| w[1] <= w[0]) {
        return Err(TwinError::Request(format!("times must increase and start at {start} or later")));
    }
    let mut run =
        Run { model: &*model, record: twin.record, theta, n_obs: setup.outputs.len(), n_period: None };
    let mut window = Window::free(start, times, run.n_obs, record.inputs.clone());
    let restarts = model.spec().restart;
    let state = match twin.period {
        Some(_) if !restarts => {
            let message = "a model that cannot restart from a state has no periodic start";
            return Err(TwinError::Request(message.to_owned()));
        }
        None if !restarts => Vec::new(),
        None => run.initial(&window)?,
        Some(_) if setup.is_noisy() => {
            return Err(TwinError::Request("a model with noise has no periodic start".to_owned()));
        }
        Some(period) => run.periodic(&mut window, period)?,
    };
    // Given as a state, a start without delays is the same to the last bit; with delays it lacks its past.
    let given = twin.period.map(|_| state.clone());
    let outputs = run.predict(&Arc::new(window.clone()), given)?.outputs;
    let mut recording = recording(study, &run, &setup, &window, &outputs, twin);
    let names = components(&study.spec.states);
    recording.start = names.into_iter().zip(state).collect();
    Ok(recording)
}

/// Runs periods of one length one after another from the initial state, until `last` says of a period's number, from 1, and
/// recording that it is the last one; returns that recording, whose `start` is the state at the period's start.
///
/// Times count from the start of every period, and the last is its end; all periods have the inputs of the first, and no noise.
///
/// # Errors
/// When a name is unknown, the times do not end with the period, or the model fails or cannot restart from a state.
pub fn beats(
    study: &Study,
    twin: &Twin,
    last: &mut dyn FnMut(usize, &Recording) -> bool,
) -> Result<Recording, TwinError> {
    let record = study
        .records
        .get(twin.record)
        .ok_or_else(|| TwinError::Request(format!("the study has {} records", study.records.len())))?;
    let (setup, theta) = place(study, twin)?;
    let model = study.solver_host.build(&setup)?;
    let start = record.start;
    let (Some(period), Some(end)) = (twin.period, twin.times.last()) else {
        return Err(TwinError::Request("periods need a length and times".to_owned()));
    };
    if (end - start - period).abs() > 1e-9 * period || twin.times.windows(2).any(|w| w[1] <= w[0]) {
        return Err(TwinError::Request(format!("times must increase and end with the period, at {period}")));
    }
    if !model.spec().restart {
        return Err(TwinError::Request("a model that cannot restart from a state has no periods".to_owned()));
    }
    let run = Run { model: &*model, record: twin.record, theta, n_obs: setup.outputs.len(), n_period: None };
    let window = Window::free(start, twin.times.clone(), run.n_obs, record.inputs.clone());
    let window = Arc::new(window);
    let mut state = run.initial(&window)?;
    let names = components(&study.spec.states);
    for number in 1.. {
        let found = run.predict(&window, Some(state.clone()))?;
        let mut recording = recording(study, &run, &setup, &window, &found.outputs, twin);
        recording.start = names.iter().cloned().zip(state).collect();
        if last(number, &recording) {
            return Ok(recording);
        }
        state = found.state.into_vec();
    }
    unreachable!("numbers do not end")
}

/// The setup and parameter vector of the twin: prior medians, overridden by name.
fn place(study: &Study, twin: &Twin) -> Result<(Setup, Vec<f64>), TwinError> {
    let mut setup = study.setup.clone();
    let prior = posterior::prior(study);
    let mut theta = study.theta_for(twin.record, prior.mean.as_slice());
    setup.outputs = components(&study.spec.outputs);
    // The truth has no observer, and all of the model's noise.
    setup.observer = ObserverDef::default();
    setup.noise = Some(twin.seed);
    let mut values = twin.values.clone();
    for (name, amplitude) in &twin.effects {
        values.push((amplitude_of(study, &mut setup, name)?, *amplitude));
    }
    for (name, value) in values {
        match setup.parameters.iter().position(|p| *p == name) {
            Some(index) => theta[index] = value,
            None => {
                setup.model.constants.insert(name, value);
            }
        }
    }
    in_units(study, twin, &mut setup, &theta)?;
    Ok((setup, theta))
}

/// Brings the effects into the model's units, as far as the twin without them tells how.
fn in_units(study: &Study, twin: &Twin, setup: &mut Setup, theta: &[f64]) -> Result<(), TwinError> {
    if relative(&setup.effects).next().is_none() {
        return Ok(());
    }
    let record = &study.records[twin.record];
    let times = if twin.times.is_empty() { &record.times } else { &twin.times };
    let trial = Trial { record, times: times.clone(), theta: theta.to_vec() };
    let ruler = Ruler::new(setup, &[trial], &study.solver_host).map_err(|error| match error {
        CourseError::Setup(error) => TwinError::Setup(error),
        CourseError::Run(error) => TwinError::Model(error),
    })?;
    setup.effects = setup.effects.iter().map(|effect| ruler.in_units(effect)).collect();
    Ok(())
}

/// Name of the amplitude of an effect; one that the model does not have yet is added from the study's candidates or the
/// built-in list.
fn amplitude_of(study: &Study, setup: &mut Setup, name: &str) -> Result<String, TwinError> {
    let built_in = library_in(&study.spec, &study.time_unit);
    if !setup.effects.iter().any(|e| e.name == name) {
        let Some(effect) = study.candidates.iter().chain(&built_in).find(|e| e.name == name) else {
            let names: Vec<&str> = setup
                .effects
                .iter()
                .chain(study.candidates.iter())
                .chain(&built_in)
                .map(|e| e.name.as_str())
                .collect();
            let nearest = nearest(name, names.iter().copied());
            return Err(SetupError::Unknown { what: "effect", name: name.to_owned(), nearest }.into());
        };
        setup.effects.push(effect.clone());
    }
    let effect = setup.effects.iter().find(|e| e.name == name);
    effect
        .and_then(|e| e.parameters.first())
        .map(|p| p.name.clone())
        .ok_or_else(|| TwinError::Request(format!("effect `{name}` has no amplitude")))
}

fn recording(
    study: &Study,
    run: &Run<'_>,
    setup: &Setup,
    window: &Window,
    outputs: &[f64],
    twin: &Twin,
) -> Recording {
    let n_obs = setup.outputs.len();
    let mut columns = setup.outputs.clone();
    let mut values: Vec<Vec<f64>> =
        (0..n_obs).map(|i| outputs.iter().skip(i).step_by(n_obs).copied().collect()).collect();
    let noise = noise::standard_deviations(study, &setup.outputs, &values, twin);
    for (i, (column, sd)) in values.iter_mut().zip(&noise).enumerate() {
        let mut rng = ChaCha8Rng::seed_from_u64(twin.seed);
        rng.set_stream(i as u64);
        for y in column {
            let noise: f64 = StandardNormal.sample(&mut rng);
            *y += sd * noise;
        }
    }
    for (quantity, signal) in run.model.spec().inputs.iter().zip(&window.inputs) {
        columns.push(quantity.name.clone());
        values.push(window.times.iter().map(|t| signal.at(*t)).collect());
    }
    let noise = noise::of_outputs(&setup.outputs, &noise);
    Recording {
        times: window.times.clone(),
        columns,
        values,
        noise,
        start: Vec::new(),
        n_period: run.n_period,
    }
}
