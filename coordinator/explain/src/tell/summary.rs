//! The parts of `explain.json` and of the report's figures, made from the search and the decision.
//!
//! Nothing is decided here. Next file to read: [`crate::run`].

use nalgebra::DMatrix;
use starlings_estimators::quantiles::wilson;
use starlings_estimators::{Gaussian, Optimum};
use starlings_study::posterior::{self, Estimate};

use super::figures::Curve;
use super::patch::PatchEffect;
use super::result::{Coefficient, FalseAlarm, GapRow, NamedEffect, ParameterShift, Remaining, Screened};
use crate::fit::candidate::Candidate;
use crate::fit::fitted_variant::FittedVariant;
use crate::judge::gates::JudgedFit;
use crate::judge::search_result::SearchResult;
use crate::judge::verdict::Decision;
use crate::rows::{Row, Usage, unit};
use crate::run_cache::RunCache;
use crate::screen::screening_result::ScreeningResult;

/// The parameters of a variant in physical units, in the order of its estimated vector; their covariance is widened by the
/// inflation of the residuals, and zero where a direction is free.
fn estimates(judged: &JudgedFit<'_>) -> Vec<Estimate> {
    let (fit, variant) = (&judged.fit, &judged.fit.variant);
    let n = variant.n_param();
    let unit = DMatrix::from_diagonal(variant.unit());
    let widened = |o: Optimum| &unit * o.covariance() * &unit * judged.inflation;
    let covariance = fit.optimum().map_or_else(|_| DMatrix::zeros(n, n), widened);
    posterior::estimates(&variant.study, &Gaussian { mean: fit.theta(), covariance })
}

/// The effects of a variant with their coefficients.
pub(crate) fn effects(judged: &JudgedFit<'_>) -> Vec<NamedEffect> {
    let variant = &judged.fit.variant;
    let estimates = estimates(judged);
    let of_effect = |(m, effect): (usize, &crate::fit::model_variant::AddedEffect<'_>)| {
        let def = &effect.candidate.def;
        let coefficient = |(k, parameter): (usize, &starlings_models::effect::EffectParameter)| {
            let Estimate { estimate, sd, interval95, .. } = estimates[variant.first_entry_of(m) + k];
            let (name, unit) = (parameter.name.clone(), parameter.unit.clone());
            Coefficient { name, unit, estimate, sd, interval95 }
        };
        NamedEffect {
            name: def.name.clone(),
            says: def.says.clone(),
            adds: def.adds.iter().map(|a| (a.to.clone(), a.term.clone())).collect(),
            states: def.states.iter().map(|state| (state.name.clone(), state.rate.clone())).collect(),
            parameters: def.parameters.iter().enumerate().map(coefficient).collect(),
            confounders: def.confounders.clone(),
            source: def.source.clone(),
            kind: effect.candidate.kind,
        }
    };
    variant.effects.iter().enumerate().map(of_effect).collect()
}

/// The effects of a variant as the new study writes them.
pub(crate) fn patches(judged: &JudgedFit<'_>) -> Vec<PatchEffect> {
    let named = effects(judged);
    let effects = &judged.fit.variant.effects;
    let patch = |(effect, named): (&crate::fit::model_variant::AddedEffect<'_>, NamedEffect)| PatchEffect {
        def: effect.candidate.def.clone(),
        values: named.parameters,
    };
    effects.iter().zip(named).map(patch).collect()
}

/// The screening of every candidate at its best point, with its fate.
pub(crate) fn screened(
    found: &SearchResult<'_>,
    candidates: &[Candidate],
    decision: &Decision,
    n_train: usize,
) -> Vec<Screened> {
    let excess = found.before.train - n_train as f64;
    let one = |(index, candidate): (usize, &Candidate)| {
        let sign = candidate.sign();
        let of = found.screening.iter().filter(|h| h.candidate == index);
        let best = of.max_by(|a, b| {
            let key = |h: &ScreeningResult| (h.failure.is_none(), h.allowed_gain(sign), h.score.gain);
            key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
        })?;
        let inner = candidate.def.parameters.iter().skip(1).zip(&best.point);
        let at: Vec<String> = inner.map(|(p, v)| format!("{} = {v:.4}", p.name)).collect();
        Some(Screened {
            name: candidate.name().to_owned(),
            at: at.join(", "),
            share: if excess > 0.0 { (best.score.gain / excess).min(1.0) } else { 0.0 },
            gain: best.score.gain,
            // What rounding leaves of an influence that the parameters imitate would promise any amplitude.
            amplitude: (best.failure.is_none() && !best.is_imitated()).then_some(best.score.amplitude),
            identifiable: best.score.identifiable,
            fate: fate(found, decision, index, candidate, best),
        })
    };
    let mut all: Vec<Screened> = candidates.iter().enumerate().filter_map(one).collect();
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    all
}

/// What became of a candidate, in the words of `explain.json`.
fn fate(
    found: &SearchResult<'_>,
    decision: &Decision,
    index: usize,
    candidate: &Candidate,
    best: &ScreeningResult,
) -> String {
    let named = decision.best.map(|i| found.judged[i].names()).unwrap_or_default();
    let is = |names: &[String]| names.iter().any(|n| n == candidate.name());
    let answered = matches!(
        decision.verdict,
        crate::judge::verdict::Verdict::Named | crate::judge::verdict::Verdict::Tie
    );
    let text = if answered && is(&named) {
        "named"
    } else if decision.tied.iter().any(|set| is(set)) {
        "tied"
    } else if let Some(failure) = &best.failure {
        failure.gate()
    } else if best.is_absorbed() {
        "absorbed by the parameters"
    } else if found.judged.iter().any(|j| j.fit.variant.effects.iter().any(|m| m.index == index)) {
        "refitted"
    } else if best.allowed_gain(candidate.sign()) > 0.0 || best.score.gain <= 0.0 {
        "not refitted"
    } else {
        "wrong sign"
    };
    text.to_owned()
}

/// Root mean square errors before and after, by record, channel and use.
pub(crate) fn gap(cache: &RunCache<'_>, before: &[f64], after: &[f64]) -> Vec<GapRow> {
    let study = cache.study;
    let mut list = Vec::new();
    for (r, record) in study.records.iter().enumerate() {
        for (c, channel) in record.channels.iter().enumerate() {
            for usage in [Usage::Train, Usage::HeldOut, Usage::HeldOutChannel] {
                let of = |row: &Row| row.record == r && row.channel == c && row.usage == usage;
                if cache.rows.rows.iter().any(&of) {
                    list.push(GapRow {
                        record: record.name.clone(),
                        channel: channel.output.clone(),
                        unit: unit(study, r, c),
                        usage: usage.word().to_owned(),
                        before: cache.rows.rmse(before, of),
                        after: cache.rows.rmse(after, of),
                        noise: cache.rows.noise_of(r, c).unwrap_or(channel.noise),
                    });
                }
            }
        }
    }
    list
}

/// The errors with each set of names, where it was refitted.
pub(crate) fn tied_gap(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    tied: &[Vec<String>],
) -> Vec<Vec<GapRow>> {
    let of = |set: &Vec<String>| {
        let judged = found.judged.iter().find(|judged| judged.names() == *set);
        judged.map(|judged| gap(cache, &found.base.predicted, &judged.fit.predicted)).unwrap_or_default()
    };
    tied.iter().map(of).collect()
}

/// What is left of the gap after a fit; the figures of the form are those of the variant whose form was `checked`.
pub(crate) fn remaining(
    found: &SearchResult<'_>,
    added: Option<&JudgedFit<'_>>,
    checked: Option<&JudgedFit<'_>>,
    shape: String,
) -> Remaining {
    let adequacy = added.map_or(&found.adequacy, |j| &j.adequacy);
    let left = checked.and_then(|j| j.leftover).unwrap_or_default();
    Remaining {
        rmse_over_noise: adequacy.rmse_over_noise,
        whiteness_p: adequacy.whiteness.unwrap_or(1.0),
        whiteness_tested: adequacy.whiteness.is_some(),
        inflation: adequacy.inflation,
        form_gain: left.gain,
        form_gain_held_out: left.gain_held_out,
        form_share: left.share,
        form_power: left.power,
        shape,
    }
}

/// The false-alarm rate of this search.
pub(crate) fn false_alarm(found: &SearchResult<'_>, best_gain: f64) -> FalseAlarm {
    let n = found.null_distribution.maxima.len() as f64;
    let rate = found.null_distribution.exceeding();
    let [_, upper] = wilson(rate, n);
    FalseAlarm {
        rate,
        upper95: upper,
        how: format!(
            "{n:.0} simulations of the fitted model with white noise of the stated sd, the whole library scored on each to first \
             order, against a threshold from as many others; a candidate must then still pass the other gates, so the rate is an upper bound of the search's own"
        ),
        runs: found.null_distribution.maxima.len() as u64,
        threshold: found.null_distribution.threshold,
        decoys: found.null_distribution.decoys_above(best_gain),
        nulls: None,
    }
}

/// The changes of the model's own parameters by the effects.
pub(crate) fn shifts(base: &FittedVariant<'_>, judged: &JudgedFit<'_>) -> Vec<ParameterShift> {
    let (before, own) = (base.theta(), &base.variant.study.theta);
    let shift = |after: Estimate| {
        let i = own.iter().position(|entry| entry.name == after.name)?;
        let Estimate { name, unit, estimate, sd, .. } = after;
        let (transform, prior_sd, theta) = (&own[i].transform, own[i].prior_sd, before[i]);
        let moved = transform.to_transformed(estimate);
        let in_prior_sd = [(moved - theta) / prior_sd, sd / transform.derivative(moved).abs() / prior_sd];
        let in_prior_sd = Some(in_prior_sd).filter(|ends| ends.iter().all(|v| v.is_finite()));
        Some(ParameterShift {
            name,
            unit,
            before: transform.to_physical(theta),
            after: estimate,
            sd,
            in_prior_sd,
        })
    };
    estimates(judged).into_iter().take(judged.fit.variant.n_own).filter_map(shift).collect()
}

/// Measured and simulated curves of every channel.
pub(crate) fn curves(cache: &RunCache<'_>, before: &[f64], after: Option<&[f64]>) -> Vec<Curve> {
    let study = cache.study;
    let mut list = Vec::new();
    for (r, record) in study.records.iter().enumerate() {
        for (c, channel) in record.channels.iter().enumerate() {
            let rows =
                cache.rows.rows.iter().enumerate().filter(|(_, row)| row.record == r && row.channel == c);
            let at: Vec<usize> = rows.map(|(i, _)| i).collect();
            let pick = |values: &[f64]| at.iter().map(|i| values[*i]).collect::<Vec<_>>();
            list.push(Curve {
                record: record.name.clone(),
                channel: channel.output.clone(),
                unit: unit(study, r, c),
                noise: cache.rows.noise_of(r, c).unwrap_or(channel.noise),
                held_out: channel.held_out,
                train: record.train_span(),
                time: at.iter().map(|i| cache.rows.rows[*i].time).collect(),
                observed: at.iter().map(|i| cache.rows.rows[*i].observed).collect(),
                before: pick(before),
                after: after.map(pick).unwrap_or_default(),
            });
        }
    }
    list
}
