//! What a probe of the screening tells: an influence, or that it must be made again with another amplitude, or a failure.
//!
//! Next file to read: [`crate::influence`].

use std::sync::Arc;

use starlings_estimators::Optimum;
use starlings_study::store::RunKey;

use super::{Felt, Probe};
use crate::influence::{Influence, difference};
use crate::laboratory::{Answer, Laboratory};

/// Response that a derivative is taken from: root mean square over the spread of the channel.
const WANTED: f64 = 3e-3;
/// Responses outside of these are measured again with another amplitude.
const RESPONSE: [f64; 2] = [1e-5, 5e-2];

/// What responses are measured by.
pub(super) struct Scale<'s> {
    pub(super) optimum: &'s Optimum,
    pub(super) spread: &'s [f64],
    /// Whether the influences are held.
    pub(super) is_held: bool,
}

/// What a probe answered.
pub(super) struct Response<'r> {
    pub(super) probe: &'r Probe<'r>,
    pub(super) answer: Answer,
    pub(super) runs: &'r [RunKey],
    pub(super) base: &'r Arc<Vec<f64>>,
}

/// What becomes of a probe.
pub(super) enum Next {
    /// It is measured again, with this amplitude.
    Amplitude(f64),
    /// It is done.
    Answer(Result<Felt, String>),
}

impl Response<'_> {
    /// An influence, or a better amplitude for the next round, or a failure.
    pub(super) fn next(&self, laboratory: &Laboratory<'_>, scale: &Scale<'_>, last: bool) -> Next {
        let amplitude = self.probe.amplitude;
        let predicted = match &self.answer {
            Ok(predicted) => predicted,
            Err(reason) if last => return Next::Answer(Err(reason.clone())),
            Err(_) => return Next::Amplitude(amplitude * 1e-2),
        };
        let n = laboratory.rows.rows.len().max(1) as f64;
        let relative = predicted.iter().zip(&**self.base).zip(scale.spread);
        let relative = relative.map(|((y, b), s)| ((y - b) / s).powi(2));
        let response = (relative.sum::<f64>() / n).sqrt();
        let fits = (RESPONSE[0]..=RESPONSE[1]).contains(&response);
        if fits || (last && response > 0.0) {
            Next::Answer(Ok(self.felt(laboratory, scale, predicted)))
        } else if last {
            Next::Answer(Err(String::new()))
        } else if response > 0.0 {
            Next::Amplitude(amplitude * (WANTED / response).clamp(1e-6, 1e6))
        } else {
            Next::Amplitude(amplitude * 1e3)
        }
    }

    fn felt(&self, laboratory: &Laboratory<'_>, scale: &Scale<'_>, predicted: &[f64]) -> Felt {
        let amplitude = self.probe.amplitude;
        let sensitivity = difference(&laboratory.rows.rows, predicted, self.base, amplitude);
        let train = sensitivity.select_rows(&laboratory.rows.train);
        let influence = if scale.is_held {
            Influence::Held(Arc::new(sensitivity))
        } else {
            Influence::Remembered { runs: self.runs.into(), amplitude, base: Arc::clone(self.base) }
        };
        Felt { influence, score: scale.optimum.score(&train), is_unfelt: train.amax() <= 0.0 }
    }
}
