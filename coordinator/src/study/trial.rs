//! One trial run of every record at the prior median, in this process: does the model run at all where the study starts?

use std::sync::Arc;

use starlings_models::{Job, ParticleError, SetupError};

use super::{Study, posterior};

/// What the trial showed about one channel.
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
}

/// Why the trial failed.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// The setup does not build.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The model fails at the prior median.
    #[error(
        "the model fails at the prior median on record `{record}` ({values}): {source}; check constants, priors and inputs"
    )]
    Model {
        /// Record name.
        record: String,
        /// The values it was run with.
        values: String,
        /// Why it failed.
        source: ParticleError,
    },
    /// Model and data are so far apart that the square of their difference is no number.
    #[error(
        "`{output}` of record `{record}` and its prediction at the prior median are out of all proportion: check units, and values that are codes for missing ones"
    )]
    Misfit {
        /// Record name.
        record: String,
        /// Output name.
        output: String,
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
    let model = study.surroundings.build(&study.setup)?;
    let prior = posterior::prior(study);
    let mut channels = Vec::new();
    for (index, record) in study.records.iter().enumerate() {
        let window = Arc::new(study.whole(index, false));
        let theta = study.theta_for(index, prior.mean.as_slice());
        let job = Job {
            particle: 0,
            record: index as u32,
            window: Arc::clone(&window),
            theta: theta.clone(),
            state: None,
        };
        let mut prediction = model.run(&job).map_err(|source| TrialError::Model {
            record: record.name.clone(),
            values: named(study, &theta),
            source,
        })?;
        study.measure(index, &window.times, &mut prediction.outputs);
        let n_obs = study.setup.outputs.len();
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
                return Err(TrialError::Misfit { record, output });
            }
            channels.push(TrialChannel {
                record: record.name.clone(),
                output: channel.output.clone(),
                n_obs: residuals.len(),
                rmse: (sum / residuals.len().max(1) as f64).sqrt(),
                noise: channel.noise,
            });
        }
    }
    Ok(channels)
}

/// Names and values of a job's parameters.
pub(super) fn named(study: &Study, theta: &[f64]) -> String {
    let pairs = study.setup.parameters.iter().zip(theta).map(|(name, value)| format!("{name} = {value}"));
    pairs.collect::<Vec<_>>().join(", ")
}
