//! The screening: one run per candidate and point of its grid gives its score at a finished fit.
//!
//! A run with a small amplitude gives the sensitivity of every row; the score test projects the fitted parameters out of it.
//! All candidates go to the fleet in one batch; those whose response was too small or too large for a derivative are run again
//! with another amplitude. Next files to read: [`super::response`], `score.rs` of the estimators, then [`crate::refit::search`].

use std::sync::Arc;

use starlings_estimators::Score;
use starlings_models::SetupError;
use starlings_study::Record;

use super::probe::{MeasuredInfluence, Probe};
use super::response::{ProbeOutcome, ProbeResponse, ResponseScale};
use super::screening_result::{ScreeningResult, UNSEEN, Unmeasured};

use super::along_run::ReferenceRun;
use super::influence::Influence;
use super::natural_amplitude::natural_amplitude;
use crate::error::ExplainError;
use crate::fit::candidate::Candidate;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::model_variant::{AddedEffect, ModelVariant};
use crate::locate::Track;
use crate::run_cache::{Point, RunCache};

/// Amplitude of a probe, as a share of the natural amplitude.
const PROBE: f64 = 3e-3;
/// How many times at most a candidate is measured again.
const AGAIN: usize = 2;
/// The failure of a probe for which the budget did not suffice.
const UNAFFORDED: &str = "the budget ended before its influence was measured";
/// The score of a candidate without a measured influence.
const NO_SCORE: Score = Score { gain: 0.0, amplitude: 0.0, sd: f64::INFINITY, identifiable: 0.0 };

/// Screens candidates at a fit; `of` lists (candidate, point of its grid). Effects that the fit has already are left out. Where
/// the budget does not suffice for all of them, none is measured. A candidate for whose repetition it does not suffice counts
/// as failed. The run cache notes both.
///
/// # Errors
/// When the fleet or the store fails, or the fit leaves a direction free.
pub(crate) fn screen<'c>(
    cache: &mut RunCache<'_>,
    fit: &FittedVariant<'c>,
    candidates: &'c [Candidate],
    of: &[(usize, usize)],
    tracks: &[Track],
) -> Result<Vec<ScreeningResult>, ExplainError> {
    let optimum = fit.optimum()?;
    let (mut probes, mut unusable) = (Vec::new(), Vec::new());
    for &(index, point) in of {
        if fit.variant.effects.iter().any(|m| m.candidate.name() == candidates[index].name()) {
            continue;
        }
        match probe(fit, candidates, index, point, tracks) {
            Ok(probe) => probes.push(probe),
            // Two effects that share the name of a parameter or state cannot be in one model.
            Err(error) => unusable.push(incompatible(index, &candidates[index].points[point], &error)),
        }
    }
    let spread = spread(cache);
    let unmoved = zero_amplitude(fit, &probes);
    if !cache.affords(probes.len() + usize::from(unmoved.is_some())) {
        cache.lacks(probes.len() + usize::from(unmoved.is_some()));
        cache.cut_short();
        return Ok(Vec::new());
    }
    let reference = reference(cache, fit, unmoved)?;
    let scale = ResponseScale { optimum: &optimum, spread: &spread, is_held: cache.holds(probes.len()) };
    for round in 0..=AGAIN {
        let open: Vec<usize> = (0..probes.len()).filter(|i| probes[*i].answer.is_none()).collect();
        if !cache.affords(open.len()) {
            cache.cut_short();
            for i in open {
                probes[i].answer = Some(Err(Unmeasured::Failed(UNAFFORDED.to_owned())));
            }
            break;
        }
        let points: Vec<Point<'_>> = open.iter().map(|i| probe_point(fit, &probes[*i])).collect();
        let mut found = Vec::with_capacity(open.len());
        cache.run_each(&points, |cache, k, runs, answer| {
            let probe = &probes[open[k]];
            let base = if touches_states(probe) { &reference } else { &fit.predicted };
            let response = ProbeResponse { probe, answer, runs, base };
            found.push(response.next(cache, &scale, round == AGAIN));
        })?;
        drop(points);
        for (i, next) in open.into_iter().zip(found) {
            match next {
                ProbeOutcome::Amplitude(amplitude) => probes[i].amplitude = amplitude,
                ProbeOutcome::Done(answer) => probes[i].answer = Some(answer),
            }
        }
    }
    Ok(probes.into_iter().map(finished).chain(unusable).collect())
}

/// The probe of a candidate with a first amplitude.
fn probe<'c>(
    fit: &FittedVariant<'c>,
    candidates: &'c [Candidate],
    index: usize,
    point: usize,
    tracks: &[Track],
) -> Result<Probe<'c>, SetupError> {
    let candidate = &candidates[index];
    let point = candidate.points[point].clone();
    let study = &fit.variant.study;
    let record = study.records.iter().position(Record::is_trained).unwrap_or(0);
    let theta = study.theta_for(record, fit.theta().as_slice());
    let along = ReferenceRun { study, theta: &theta, tracks };
    let [lo, hi] = candidate.def.parameters[0].range;
    let natural = natural_amplitude(&along, candidate, &point).map_or_else(
        || if lo.is_finite() && hi.is_finite() { PROBE * (hi - lo) } else { PROBE },
        |natural| PROBE * natural,
    );
    let sign = if candidate.sign() < 0.0 { -1.0 } else { 1.0 };
    let amplitude = sign * natural.min(if hi > 0.0 { hi } else { lo.abs() });
    let effects = fit.variant.effects.iter().cloned();
    let effects = effects.chain([AddedEffect { candidate, index, unit: 1.0 }]).collect();
    let variant = ModelVariant::new(fit.variant.base, effects, &fit.variant.left_out)?;
    Ok(Probe { candidate: index, variant, point, amplitude, answer: None })
}

fn probe_point<'p>(fit: &FittedVariant<'_>, probe: &'p Probe<'_>) -> Point<'p> {
    let mut z = probe.variant.continue_from(&fit.variant, fit.z(), &probe.point);
    z[probe.variant.first_entry_of(probe.variant.effects.len() - 1)] = probe.amplitude;
    Point { study: &probe.variant.study, theta: probe.variant.theta(&z) }
}

/// Whether the effect changes how the states are integrated.
fn touches_states(probe: &Probe<'_>) -> bool {
    let Some(effect) = probe.variant.effects.last() else { return false };
    let outputs = &probe.variant.study.spec.outputs;
    let states = &probe.variant.study.spec.states;
    let only_output = |to: &str| outputs.iter().any(|q| q.name == to) && !states.iter().any(|q| q.name == to);
    !(effect.candidate.def.states.is_empty() && effect.candidate.def.adds.iter().all(|a| only_output(&a.to)))
}

/// The fitted model with an effect of amplitude zero in its rates. A built-in model with a step of its own is integrated in
/// another way as soon as an effect is in its rates; the difference must not count as the influence of the effect. `None` where
/// the model has no step of its own.
fn zero_amplitude<'p>(fit: &FittedVariant<'_>, probes: &'p [Probe<'_>]) -> Option<Point<'p>> {
    let own_step = fit.variant.study.setup.model.equations.is_none();
    let probe = probes.iter().find(|p| touches_states(p)).filter(|_| own_step)?;
    let z = probe.variant.continue_from(&fit.variant, fit.z(), &probe.point);
    Some(Point { study: &probe.variant.study, theta: probe.variant.theta(&z) })
}

/// The predictions with which those of an effect in the rates are compared.
fn reference(
    cache: &mut RunCache<'_>,
    fit: &FittedVariant<'_>,
    unmoved: Option<Point<'_>>,
) -> Result<Arc<Vec<f64>>, ExplainError> {
    let Some(point) = unmoved else { return Ok(Arc::clone(&fit.predicted)) };
    let answer = cache.run(&[point])?.swap_remove(0);
    Ok(answer.unwrap_or_else(|_| Arc::clone(&fit.predicted)))
}

/// Spread of the observed values of each row's channel, over all records.
fn spread(cache: &RunCache<'_>) -> Vec<f64> {
    let n_output = cache.study.setup.outputs.len();
    let mut sums = vec![(0.0, 0.0, 0.0); n_output];
    for row in &cache.rows.rows {
        let (n, sum, square) = &mut sums[row.output];
        *n += 1.0;
        *sum += row.observed;
        *square += row.observed * row.observed;
    }
    let sd = |(n, sum, square): &(f64, f64, f64)| ((square - sum * sum / n) / n).max(0.0).sqrt();
    let by_output: Vec<f64> = sums.iter().map(sd).collect();
    cache.rows.rows.iter().map(|row| by_output[row.output].max(row.noise)).collect()
}

/// The result of a candidate that cannot be in one model with the effects of the fit.
fn incompatible(candidate: usize, point: &[f64], error: &SetupError) -> ScreeningResult {
    ScreeningResult {
        candidate,
        point: point.to_vec(),
        influence: Influence::none(),
        score: NO_SCORE,
        failure: Some(Unmeasured::Failed(error.to_string())),
        is_significant: false,
        may_be_imitated: false,
    }
}

fn finished(probe: Probe<'_>) -> ScreeningResult {
    let Probe { candidate, point, answer, .. } = probe;
    let (influence, score, failure) = match answer.unwrap_or(Err(UNSEEN)) {
        Ok(MeasuredInfluence { influence, score, is_unfelt }) => {
            (influence, score, is_unfelt.then_some(Unmeasured::NoInfluence("what is fitted")))
        }
        Err(failure) => (Influence::none(), NO_SCORE, Some(failure)),
    };
    ScreeningResult {
        candidate,
        point,
        influence,
        score,
        failure,
        is_significant: false,
        may_be_imitated: false,
    }
}
