//! Why a fit fails where errors of the measurement are far larger than the movement, which looks like too few steps for so many terms.
//!
//! Next file to read: `error.rs`.

use std::fmt::Write as _;

use starlings_estimators::inference::{IncrementNoise, InferenceError, Structure, Sums, increment_noise};

use crate::error::InferError;

/// Share of the variance of neighbouring differences from which errors of the measurement hide the movement.
const HIDDEN: f64 = 0.9;

/// The error of a fit as it is told: with the errors of the measurement where they are why it failed.
pub(crate) fn told(error: InferenceError, sums: &Sums, structure: &Structure) -> InferError {
    if !matches!(error, InferenceError::NotSettled { .. } | InferenceError::DiffusionNotDefinite { .. }) {
        return error.into();
    }
    let hidden: Vec<IncrementNoise> =
        increment_noise(sums, structure).into_iter().filter(|s| s.share > HIDDEN).collect();
    if hidden.is_empty() {
        return error.into();
    }
    let mut says = String::new();
    for (k, of) in hidden.iter().enumerate() {
        let comma = if k > 0 { ", " } else { "" };
        let IncrementNoise { equation, measured, moves, .. } = of;
        let _ =
            write!(says, "{comma}`{equation}` (errors of sd {measured:.2e}, movement {moves:.2e} or less)");
    }
    InferError::Hidden { says }
}
