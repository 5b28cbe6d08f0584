//! A twin experiment: the study's model run forward with chosen values and noise, to make data whose truth is known.
//!
//! Nothing is estimated and no fleet is needed. The noise of every output is a ChaCha8 stream of its own, so adding an
//! output changes no other's data.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_models::{Forward, Job, ParticleError, Setup, SetupError, Window, nearest};

use super::{Study, posterior};

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
    /// Seed of the noise.
    pub seed: u64,
    /// Times at which the outputs are wanted; empty takes the record's.
    pub times: Vec<f64>,
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
/// When a name is unknown, a time lies before the record, or the model fails.
pub fn simulate(study: &Study, twin: &Twin) -> Result<Recording, TwinError> {
    let record = study
        .records
        .get(twin.record)
        .ok_or_else(|| TwinError::Request(format!("the study has {} records", study.records.len())))?;
    let (setup, theta) = place(study, twin)?;
    let model = setup.build()?;
    let times = if twin.times.is_empty() { record.times.clone() } else { twin.times.clone() };
    let start = record.times.first().copied().unwrap_or_default();
    if times.first().is_some_and(|t| *t < start) || times.windows(2).any(|w| w[1] <= w[0]) {
        return Err(TwinError::Request(format!("times must increase and start at {start} or later")));
    }
    let window = Window {
        start,
        observed: vec![f64::NAN; times.len() * setup.outputs.len()],
        times,
        inputs: record.inputs.clone(),
    };
    let window = Arc::new(window);
    let job =
        Job { particle: 0, record: twin.record as u32, window: Arc::clone(&window), theta, state: None };
    let prediction = model.run(&job)?;
    Ok(recording(&*model, &setup, &window, &prediction.outputs, twin))
}

/// The setup and parameter vector of the twin: prior medians, overridden by name.
fn place(study: &Study, twin: &Twin) -> Result<(Setup, Vec<f64>), TwinError> {
    let mut setup = study.setup.clone();
    let prior = posterior::prior(study);
    let mut theta = study.theta_for(twin.record, prior.mean.as_slice());
    setup.outputs = study.spec.outputs.iter().map(|q| q.name.clone()).collect();
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
    Ok((setup, theta))
}

/// Name of the amplitude of an effect; one that the model does not have yet is added from the study's candidates or the
/// built-in list.
fn amplitude_of(study: &Study, setup: &mut Setup, name: &str) -> Result<String, TwinError> {
    let built_in = starlings_models::effect::library(&study.spec);
    if !setup.effects.iter().any(|e| e.name == name) {
        let Some(effect) = study.candidates.iter().chain(&built_in).find(|e| e.name == name) else {
            let names: Vec<&str> = setup
                .effects
                .iter()
                .chain(&study.candidates)
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

fn recording(model: &dyn Forward, setup: &Setup, window: &Window, outputs: &[f64], twin: &Twin) -> Recording {
    let n_obs = setup.outputs.len();
    let mut columns = setup.outputs.clone();
    let mut values: Vec<Vec<f64>> = (0..n_obs)
        .map(|i| {
            let mut rng = ChaCha8Rng::seed_from_u64(twin.seed);
            rng.set_stream(i as u64);
            let mut noise = move || -> f64 { StandardNormal.sample(&mut rng) };
            outputs.iter().skip(i).step_by(n_obs).map(|y| y + twin.noise * noise()).collect()
        })
        .collect();
    for (quantity, signal) in model.spec().inputs.iter().zip(&window.inputs) {
        columns.push(quantity.name.clone());
        values.push(window.times.iter().map(|t| signal.at(*t)).collect());
    }
    Recording { times: window.times.clone(), columns, values }
}
