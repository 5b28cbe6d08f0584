//! A run's answer: what its outcome says, the key that says everything it depends on, and the bytes it is remembered by.
//!
//! Next file to read: [`super::laboratory`].

use std::sync::Arc;

use starlings_models::{Job, ParticleError, Prediction};

use super::ExplainError;
use crate::fleet::{Outcome, SetupId};
use crate::study::RunError;
use crate::study::store::RunKey;

/// The outputs of one run, or why there are none.
pub(super) type Known = Result<Arc<Vec<f64>>, String>;

/// The prediction of a run, or why the model has none.
///
/// # Errors
/// When the run was lost with its workers or never fitted the model: that says nothing of the model, and to go on without it
/// would make the findings depend on the fleet.
pub(super) fn sound(
    outcome: Outcome,
    particle: u32,
    record: &str,
) -> Result<Result<Prediction, String>, ExplainError> {
    match outcome.result {
        Err(error @ (ParticleError::Lost { .. } | ParticleError::BadJob(_))) => {
            let (particle, record, reason) = (particle as usize, record.to_owned(), error.to_string());
            Err(RunError::NoAnswer { particle, record, values: String::new(), reason }.into())
        }
        Err(error) => Ok(Err(error.to_string())),
        Ok(prediction) => Ok(Ok(prediction)),
    }
}

/// Everything that the answer of a run depends on: the programs that make it (a digest), the setup and the job. Not what was
/// observed: every run is free.
pub(super) fn key(programs: &[u8; 32], setup: &SetupId, job: &Job) -> RunKey {
    let mut hasher = blake3::Hasher::new();
    hasher.update(programs);
    hasher.update(setup);
    hasher.update(&u64::from(job.record).to_le_bytes());
    let mut numbers = |values: &[f64]| {
        // Lengths keep neighbouring lists apart.
        hasher.update(&(values.len() as u64).to_le_bytes());
        for value in values {
            hasher.update(&value.to_le_bytes());
        }
    };
    numbers(&job.theta);
    numbers(job.state.as_deref().unwrap_or_default());
    numbers(&[job.window.start]);
    numbers(&job.window.times);
    for signal in &job.window.inputs {
        numbers(&signal.times);
        numbers(&signal.values);
    }
    *hasher.finalize().as_bytes()
}

/// One byte that says which, then the numbers or the text.
pub(super) fn encode(known: &Known) -> Vec<u8> {
    match known {
        Ok(outputs) => std::iter::once(1).chain(outputs.iter().flat_map(|v| v.to_le_bytes())).collect(),
        Err(reason) => [&[0], reason.as_bytes()].concat(),
    }
}

/// What was remembered.
pub(super) fn decode(body: &[u8]) -> Known {
    let (which, rest) = body.split_first().unwrap_or((&0, &[]));
    if *which == 0 {
        return Err(String::from_utf8_lossy(rest).into_owned());
    }
    let number = |bytes: &[u8]| bytes.try_into().map_or(f64::NAN, f64::from_le_bytes);
    Ok(Arc::new(rest.chunks(8).map(number).collect()))
}
