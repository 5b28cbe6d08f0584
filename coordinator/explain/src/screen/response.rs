//! What is made of the run of a probe: an influence, another amplitude to try, or a failure.
//!
//! Next file to read: [`super::influence`].

use std::sync::Arc;

use starlings_estimators::Optimum;
use starlings_study::store::RunKey;

use super::influence::{Influence, difference};
use super::probe::{MeasuredInfluence, Probe};
use super::screening_result::{UNSEEN, Unmeasured};
use crate::run_cache::{RowPredictions, RunCache};

/// Size of a response at which a derivative is taken: root mean square over the spread of the channel.
const WANTED: f64 = 3e-3;
/// A response outside of this interval is measured again with another amplitude.
const RESPONSE: [f64; 2] = [1e-5, 5e-2];

/// What is the same for all probes of a screening.
pub(super) struct ResponseScale<'s> {
    pub(super) optimum: &'s Optimum,
    pub(super) spread: &'s [f64],
    /// Whether the influences are held.
    pub(super) is_held: bool,
}

/// The run of a probe.
pub(super) struct ProbeResponse<'r> {
    pub(super) probe: &'r Probe<'r>,
    pub(super) answer: RowPredictions,
    pub(super) runs: &'r [RunKey],
    pub(super) base: &'r Arc<Vec<f64>>,
}

/// What follows for a probe.
pub(super) enum ProbeOutcome {
    /// Measure it again, with this amplitude.
    Amplitude(f64),
    /// It is measured, or has failed.
    Done(Result<MeasuredInfluence, Unmeasured>),
}

impl ProbeResponse<'_> {
    /// An influence, or a better amplitude for the next round, or a failure.
    pub(super) fn next(&self, cache: &RunCache<'_>, scale: &ResponseScale<'_>, last: bool) -> ProbeOutcome {
        let amplitude = self.probe.amplitude;
        let predicted = match &self.answer {
            Ok(predicted) => predicted,
            Err(reason) if last => return ProbeOutcome::Done(Err(Unmeasured::Failed(reason.clone()))),
            Err(_) => return ProbeOutcome::Amplitude(amplitude * 1e-2),
        };
        let n = cache.rows.rows.len().max(1) as f64;
        let relative = predicted.iter().zip(&**self.base).zip(scale.spread);
        let relative = relative.map(|((y, b), s)| ((y - b) / s).powi(2));
        let response = (relative.sum::<f64>() / n).sqrt();
        let fits = (RESPONSE[0]..=RESPONSE[1]).contains(&response);
        if fits || (last && response > 0.0) {
            ProbeOutcome::Done(Ok(self.measured(cache, scale, predicted)))
        } else if last {
            ProbeOutcome::Done(Err(UNSEEN))
        } else if response > 0.0 {
            ProbeOutcome::Amplitude(amplitude * (WANTED / response).clamp(1e-6, 1e6))
        } else {
            ProbeOutcome::Amplitude(amplitude * 1e3)
        }
    }

    fn measured(
        &self,
        cache: &RunCache<'_>,
        scale: &ResponseScale<'_>,
        predicted: &[f64],
    ) -> MeasuredInfluence {
        let amplitude = self.probe.amplitude;
        let sensitivity = difference(&cache.rows, predicted, self.base, amplitude);
        let train = sensitivity.select_rows(&cache.rows.train);
        let influence = if scale.is_held {
            Influence::Held(Arc::new(sensitivity))
        } else {
            Influence::Remembered { runs: self.runs.into(), amplitude, base: Arc::clone(self.base) }
        };
        MeasuredInfluence { influence, score: scale.optimum.score(&train), is_unfelt: train.amax() <= 0.0 }
    }
}
