//! What chance alone would give: the distribution of the largest score of a search where no effect is missing, and the scores of
//! decoys, which are candidates with their time reversed or shifted.
//!
//! Nothing is run: scores are linear in the residuals, so their joint distribution without a gap follows from the
//! sensitivities that the screening measured. Next file to read: [`super::gates`].

use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_estimators::{Optimum, null_maxima, score_correlation};

use super::effective_noise::training_stretches;
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::rows::Rows;
use crate::screen::screening_result::ScreeningResult;

/// Number of simulations without a gap from which the threshold is taken, and of those that measure how often it is exceeded.
const SIMULATIONS: usize = 4000;
/// Rate of false alarms for which the threshold of the search is set.
pub(crate) const ALARM_RATE: f64 = 0.005;
/// Lowest threshold, even if the simulations give a lower one.
pub(crate) const LEAST: f64 = 10.0;
/// A decoy whose influence correlates with that of its candidate by more than this is not used.
const RESEMBLANCE: f64 = 0.9;
/// Shifts of a decoy, as shares of each stretch.
const SHIFTS: [f64; 3] = [0.21, 0.47, 0.73];

/// The distribution of the search's best score where nothing is missing.
#[derive(Clone, Debug, Default)]
pub(crate) struct NullDistribution {
    /// Largest gain in each simulation of the second half, from which the threshold was not taken, sorted.
    pub maxima: Vec<f64>,
    /// The gain that a candidate must exceed, in units of the effective noise.
    pub threshold: f64,
    /// Gain of each decoy on the residuals of the model as it is.
    pub decoys: Vec<f64>,
}

impl NullDistribution {
    /// Simulates the search without a gap, and scores decoys. `sensitivity` gives the influence of a candidate on the training
    /// rows; about `at_a_time` of them are held at a time.
    ///
    /// # Errors
    /// Those of `sensitivity`.
    pub(crate) fn new(
        optimum: &Optimum,
        rows: &Rows,
        screening: &[ScreeningResult],
        candidates: &[Candidate],
        seed: u64,
        at_a_time: usize,
        sensitivity: &dyn Fn(&ScreeningResult) -> Result<DVector<f64>, ExplainError>,
    ) -> Result<Self, ExplainError> {
        let usable: Vec<&ScreeningResult> =
            screening.iter().filter(|h| h.failure.is_none() && !h.is_imitated()).collect();
        if usable.is_empty() {
            return Ok(Self { threshold: LEAST, ..Self::default() });
        }
        let stretches = training_stretches(rows);
        let mut decoys = Vec::new();
        for result in &usable {
            decoys.extend(decoys_of(optimum, &stretches, &sensitivity(result)?));
        }
        let own = |k: usize| Ok::<_, ExplainError>(optimum.unimitated(&sensitivity(usable[k])?));
        let correlation = score_correlation(usable.len(), at_a_time, own)?;
        let signs: Vec<f64> = usable.iter().map(|h| candidates[h.candidate].sign()).collect();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || StandardNormal.sample(&mut random);
        let mut first = null_maxima(correlation, &signs, 2 * SIMULATIONS, &mut normal);
        // The sample from which a quantile is taken exceeds it at exactly the nominal rate; only another sample measures the
        // true one.
        let mut maxima = first.split_off(SIMULATIONS);
        first.sort_by(f64::total_cmp);
        maxima.sort_by(f64::total_cmp);
        let at = ((1.0 - ALARM_RATE) * SIMULATIONS as f64) as usize;
        let threshold = first[at.min(SIMULATIONS - 1)].max(LEAST);
        Ok(Self { maxima, threshold, decoys })
    }

    /// Share of the simulations whose best gain exceeds the threshold.
    pub(crate) fn exceeding(&self) -> f64 {
        let above = self.maxima.iter().filter(|m| **m > self.threshold).count();
        above as f64 / self.maxima.len().max(1) as f64
    }

    /// Share of the decoys whose gain is at least `gain`.
    pub(crate) fn decoys_above(&self, gain: f64) -> f64 {
        let above = self.decoys.iter().filter(|d| **d >= gain).count();
        above as f64 / self.decoys.len().max(1) as f64
    }
}

/// The gains of a candidate whose influence is reversed or shifted in time within every stretch of the training data.
fn decoys_of(
    optimum: &Optimum,
    stretches: &[std::ops::Range<usize>],
    sensitivity: &DVector<f64>,
) -> Vec<f64> {
    let own = optimum.unimitated(sensitivity);
    let gain = |decoy: DVector<f64>| {
        let of_decoy = optimum.unimitated(&decoy);
        let size = own.norm() * of_decoy.norm();
        let differs = size > 0.0 && own.dot(&of_decoy).abs() < RESEMBLANCE * size;
        differs.then(|| optimum.score(&decoy).gain)
    };
    let shifted = |share: f64| moved(sensitivity, stretches, |i, n| (i + (share * n as f64) as usize) % n);
    let reversed = || moved(sensitivity, stretches, |i, n| n - 1 - i);
    let shifted = SHIFTS.into_iter().filter_map(|share| gain(shifted(share)));
    shifted.chain(std::iter::once_with(|| gain(reversed())).flatten()).collect()
}

fn moved(
    series: &DVector<f64>,
    stretches: &[std::ops::Range<usize>],
    from: impl Fn(usize, usize) -> usize,
) -> DVector<f64> {
    let mut moved = series.clone();
    for stretch in stretches {
        let n = stretch.len();
        for i in 0..n {
            moved[stretch.start + i] = series[stretch.start + from(i, n)];
        }
    }
    moved
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::DMatrix;

    use super::*;
    use crate::rows::{Usage, white};
    use crate::screen::influence::Influence;
    use starlings_models::EffectDef;
    use starlings_models::effect::EffectParameter;

    #[test]
    fn the_false_alarm_rate_is_counted_on_simulations_that_the_threshold_does_not_know() {
        let (m, n_candidate) = (120, 30);
        let rows = Rows::sample(m, |_| Usage::Train);
        let candidate = Candidate::new(EffectDef {
            parameters: vec![EffectParameter::default()],
            ..EffectDef::default()
        });
        let candidates = vec![candidate; n_candidate];
        let none = DVector::zeros(1);
        let optimum = Optimum::new(&white(m, 1), &DMatrix::from_element(m, 1, 1.0), &none, &none).unwrap();
        let result = |candidate: usize| {
            let sensitivity = white(m, 100 + candidate as u64);
            let score = optimum.score(&sensitivity);
            let influence = Influence::Held(Arc::new(sensitivity));
            ScreeningResult {
                candidate,
                point: Vec::new(),
                influence,
                score,
                failure: None,
                is_significant: false,
                may_be_imitated: false,
            }
        };
        let screening: Vec<ScreeningResult> = (0..n_candidate).map(result).collect();
        let held = |result: &ScreeningResult| match &result.influence {
            Influence::Held(sensitivity) => Ok(DVector::clone(sensitivity)),
            Influence::Remembered { .. } => unreachable!("none is remembered here"),
        };
        let of_seed = |seed| {
            NullDistribution::new(&optimum, &rows, &screening, &candidates, seed, n_candidate, &held).unwrap()
        };
        let backgrounds: Vec<NullDistribution> = (0..12).map(of_seed).collect();
        let rates: Vec<f64> = backgrounds.iter().map(NullDistribution::exceeding).collect();
        assert!(backgrounds.iter().all(|b| b.threshold > LEAST && b.maxima.len() == SIMULATIONS));
        let mean = rates.iter().sum::<f64>() / rates.len() as f64;
        // Each rate scatters by the counts of both samples, sqrt(2·20)/4000 = 0.0016, their mean by a twelfth of its variance:
        // 0.00046. Four of these.
        assert!((mean - ALARM_RATE).abs() < 0.0019, "{rates:?}");
        let scatter = rates.iter().map(|r| (r - mean).powi(2)).sum::<f64>().sqrt() / 11.0_f64.sqrt();
        assert!((0.0006..0.004).contains(&scatter), "a measured rate scatters: {rates:?}");
    }

    #[test]
    fn a_decoy_is_the_same_course_at_another_time() {
        let series = DVector::from_vec(vec![1.0, 2.0, 3.0, 10.0, 20.0]);
        let reversed = moved(&series, &[0..3, 3..5], |i, n| n - 1 - i);
        assert_eq!(reversed.as_slice(), [3.0, 2.0, 1.0, 20.0, 10.0]);
    }
}
