//! What a restart goes on from: written after every block, all or nothing.
//!
//! Next file to read: [`super`].

use std::path::Path;

use serde::{Deserialize, Serialize};
use starlings_estimators::inference::{DetectorState, Posterior, StreamState, Window};

use crate::error::InferError;
use crate::run::Asked;

/// A recording that is followed, after a block.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Saved {
    /// Fingerprint of what was asked of which columns ([`fingerprint`]).
    pub(crate) asked: String,
    pub(crate) step: f64,
    /// Time of the last row.
    pub(crate) time: f64,
    pub(crate) n_step: u64,
    pub(crate) detector: DetectorState,
    pub(crate) stream: StreamState,
    pub(crate) window: Window,
    pub(crate) posterior: Option<Posterior>,
    /// Whether errors of the measurement matter.
    #[serde(default)]
    pub(crate) is_noisy: bool,
}

/// Tells what is asked of which columns from anything else: the model with its constants and functions, the sampling step, the columns,
/// and the choices of the fit and of the following.
pub(crate) fn fingerprint(asked: &Asked<'_>) -> Result<String, InferError> {
    let choice = asked.choice;
    let unwritten = |error: serde_json::Error| InferError::Setting(error.to_string());
    let setup = serde_json::to_string(&asked.setup).map_err(unwritten)?;
    let columns = choice.records.first().map(|record| (&record.time, &record.columns));
    let fit = (choice.diffusion, choice.prefactor, choice.measured, &choice.priors);
    let text = format!("{setup}\n{columns:?}\n{fit:?}\n{:?}", choice.follow);
    Ok(blake3::hash(text.as_bytes()).to_hex().to_string())
}

/// Reads a state; `None` where there is no file.
pub(crate) fn read(file: &Path) -> Result<Option<Saved>, InferError> {
    let text = match std::fs::read_to_string(file) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => {
            return Err(InferError::File { what: format!("cannot read {}", file.display()), error });
        }
    };
    let damaged = |message: String| InferError::State { file: file.to_owned(), message };
    let saved: Saved = serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
    if !(saved.step > 0.0 && saved.step.is_finite() && saved.time.is_finite()) {
        return Err(damaged("its step or its time is no number".to_owned()));
    }
    Ok(Some(saved))
}

/// Writes a state in the place of the one before.
pub(crate) fn write(file: &Path, saved: &Saved) -> Result<(), InferError> {
    let lost = |error| InferError::File { what: format!("cannot write {}", file.display()), error };
    let text = serde_json::to_string(saved).map_err(|error| lost(std::io::Error::other(error)))?;
    starlings_study::store::folder::write(file, &text).map_err(lost)
}
