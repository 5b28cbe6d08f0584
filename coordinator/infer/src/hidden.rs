//! Why a fit fails where errors of the measurement are far larger than the movement, which looks like too few steps for so many terms.
//!
//! Next file to read: `error.rs`.

use std::fmt::Write as _;

use starlings_estimators::inference::{IncrementNoise, InferenceError, Structure, Sums, increment_noise};

use crate::error::InferError;

/// Share of the variance of neighbouring differences from which errors of the measurement hide the movement.
const HIDDEN: f64 = 0.9;

/// How many times as far as they do rows would differ by given errors alone, from which these are surely too large.
const TOO_LARGE: f64 = 1.25;

/// The error of a smoothing under errors of standard deviation `sd` as it is told: with what neighbouring rows show where no path was found, or
/// where nothing settled under errors that are too large.
pub(crate) fn lost(error: InferError, sd: f64, sums: Option<&Sums>, structure: &Structure) -> InferError {
    let (InferError::Estimate { error: of }, Some(sums)) = (&error, sums) else { return error };
    let squares = sums.q().diagonal() / sums.n_step() as f64;
    let alone = std::f64::consts::SQRT_2 * sd;
    let (mut is_too_large, mut list) = (false, Vec::new());
    for (equation, square) in structure.equations().iter().zip(&squares) {
        let differs = sums.step() * square.sqrt();
        is_too_large |= alone > TOO_LARGE * differs;
        list.push(format!("`{equation}` {differs:.2e}"));
    }
    let help = match of {
        InferenceError::NotSettled { .. }
        | InferenceError::DiffusionNotDefinite { .. }
        | InferenceError::Overflow { .. }
            if is_too_large =>
        {
            "give the standard deviation of the sensor's errors in the unit of the states, which is at most 0.7 times what rows differ by, or \
             measurement_noise = \"auto\""
        }
        InferenceError::Overflow { .. } => "record in shorter steps, or give measurement_noise = \"auto\"",
        _ => return error,
    };
    let says = format!(
        "neighbouring rows differ, root mean square, by {}, and such errors alone make them differ by {alone:.2e}",
        list.join(", ")
    );
    InferError::Lost { sd, says, help }
}

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
