//! A run's answer and the bytes it is remembered by.
//!
//! Answers are predictions, model failures and timeouts: an outcome has nothing else, so that no failure of a place is remembered.
//! Next file to read: [`super::laboratory`].

use std::sync::Arc;

use starlings_fleet::{FleetError, Outcome};
use starlings_study::{RunError, Study};

use super::ExplainError;

/// The outputs of one run, or why there are none.
pub(super) type Known = Result<Arc<Vec<f64>>, String>;

/// What an outcome says: a failure of the model is an answer, and so is a timeout.
///
/// # Errors
/// When the prediction has another length than the run asked for, which says nothing of the model.
pub(super) fn taken(
    study: &Study,
    outcome: Outcome,
    particle: u32,
    record: usize,
    n_value: usize,
) -> Result<Known, ExplainError> {
    let prediction = match outcome.result {
        Ok(prediction) => prediction,
        Err(failure) => return Ok(Err(failure.to_string())),
    };
    let n = prediction.outputs.len();
    if n == n_value {
        return Ok(Ok(Arc::new(prediction.outputs)));
    }
    Err(no_answer(study, particle, record, format!("{n} predicted values for {n_value}")))
}

/// A fleet's failure, with the name of the record where it is about one run.
pub(super) fn told(study: &Study, error: FleetError) -> ExplainError {
    match error {
        FleetError::NoAnswer { particle, record, reason, .. } => {
            no_answer(study, particle, record as usize, reason)
        }
        other => other.into(),
    }
}

fn no_answer(study: &Study, particle: u32, record: usize, reason: String) -> ExplainError {
    let record = study.records[record].name.clone();
    RunError::NoAnswer { particle: particle as usize, record, values: String::new(), reason }.into()
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
