//! Whether a job fits the model that it is for: lengths, times, inputs.
//!
//! Next file to read: [`crate::simulator`].

use crate::{Job, ParticleError, Spec, Window};

/// Refuses a job whose lengths or times do not fit: so many parameter values, so many rows, the inputs of the specification.
pub(crate) fn check_job(job: &Job, n_value: usize, n_row: usize, spec: &Spec) -> Result<(), ParticleError> {
    let window = &*job.window;
    let (given, wanted) = (job.theta.len(), n_value);
    if given != wanted {
        return Err(bad(format!("{given} parameter values for {wanted} parameters")));
    }
    let (given, wanted) = (window.observed.len(), n_row * window.times.len());
    if given != wanted {
        return Err(bad(format!("{given} observed values where outputs times times make {wanted}")));
    }
    if !(window.since.is_empty() || window.since.len() == n_row) {
        return Err(bad(format!("{} times of last values for {n_row} rows", window.since.len())));
    }
    if !window.since.iter().all(|last| *last <= window.start) {
        return Err(bad("a last value before the window that is not before its start".to_owned()));
    }
    let (given, wanted) = (window.inputs.len(), spec.inputs.len());
    if given != wanted {
        return Err(bad(format!("{given} input signals for a model with {wanted}")));
    }
    for (signal, input) in window.inputs.iter().zip(&spec.inputs) {
        if signal.times.len() != signal.values.len() || signal.times.is_empty() {
            let (times, values) = (signal.times.len(), signal.values.len());
            return Err(bad(format!("input `{}` has {times} times and {values} values", input.name)));
        }
        if !signal.times.is_sorted_by(|a, b| a < b) {
            return Err(bad(format!("the times of input `{}` do not increase", input.name)));
        }
    }
    check_times(window)
}

/// Refuses a window without times, with times out of order or before its start.
fn check_times(window: &Window) -> Result<(), ParticleError> {
    let Some(&first) = window.times.first() else {
        return Err(bad("a window without observation times".to_owned()));
    };
    if !window.start.is_finite() || !window.times.iter().all(|t| t.is_finite()) {
        return Err(bad("a window with a time that is not finite".to_owned()));
    }
    if first < window.start || !window.times.is_sorted_by(|a, b| a < b) {
        return Err(bad("observation times must increase from the window's start".to_owned()));
    }
    Ok(())
}

pub(crate) fn bad(message: String) -> ParticleError {
    ParticleError::BadJob(message)
}
