//! The result of a run as it is remembered, and its bytes in the store.
//!
//! A result is a prediction, a failure of the model or a timeout. Failures of a worker are not outcomes and are never remembered.
//! Next file to read: [`crate::run_cache`].

use std::sync::Arc;

use starlings_fleet::Outcome;
use starlings_study::Study;

use crate::error::{ExplainError, no_answer};

/// The outputs of one run, or the reason why it has none.
pub(crate) type RememberedRun = Result<Arc<Vec<f64>>, String>;

/// The result to remember of an outcome: outputs, or the reason of a failure or timeout.
///
/// # Errors
/// When the prediction has another length than was requested, which is a fault of the worker and not of the model.
pub(crate) fn from_outcome<S>(
    study: &Study,
    outcome: Outcome<S>,
    particle: u32,
    record: usize,
    n_value: usize,
) -> Result<RememberedRun, ExplainError> {
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

/// One byte, 1 for outputs and 0 for a failure, then the numbers or the text.
pub(crate) fn encode(run: &RememberedRun) -> Vec<u8> {
    match run {
        Ok(outputs) => std::iter::once(1).chain(outputs.iter().flat_map(|v| v.to_le_bytes())).collect(),
        Err(reason) => [&[0], reason.as_bytes()].concat(),
    }
}

/// The result from its bytes.
pub(crate) fn decode(body: &[u8]) -> RememberedRun {
    let (which, rest) = body.split_first().unwrap_or((&0, &[]));
    if *which == 0 {
        return Err(String::from_utf8_lossy(rest).into_owned());
    }
    let number = |bytes: &[u8]| bytes.try_into().map_or(f64::NAN, f64::from_le_bytes);
    Ok(Arc::new(rest.chunks(8).map(number).collect()))
}
