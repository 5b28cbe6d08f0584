//! The findings in the words and numbers of `explain.json` and of its report.
//!
//! Nothing is decided here. Next file to read: [`super::run`].

use nalgebra::{DMatrix, DVector};
use starlings_estimators::{BlockRow, Gaussian, Optimum};
use starlings_study::posterior::{self, Estimate, Z95};

use super::candidate::Candidate;
use super::figures::Curve;
use super::fit::Fitted;
use super::judge::Judged;
use super::laboratory::Laboratory;
use super::patch::PatchEffect;
use super::result::{Coefficient, FalseAlarm, GapRow, NamedEffect, ParameterShift, Remaining, Screened};
use super::rows::{Row, Usage, unit};
use super::screen::Hit;
use super::search::Found;
use super::verdict::Decision;

/// The parameters of a version in physical units, in the order of its estimated vector; their covariance is widened by the
/// inflation of the residuals, and zero where a direction is free.
fn estimates(judged: &Judged<'_>) -> Vec<Estimate> {
    let (fit, version) = (&judged.fit, &judged.fit.version);
    let n = version.n_param();
    let unit = DMatrix::from_diagonal(version.unit());
    let widened = |o: Optimum| &unit * o.covariance() * &unit * judged.inflation;
    let covariance = fit.optimum().map_or_else(|_| DMatrix::zeros(n, n), widened);
    posterior::estimates(&version.study, &Gaussian { mean: fit.theta(), covariance })
}

/// Standard deviation of the prediction of every row by the uncertainty of the fit and of the values that a held-out record has
/// of its own, in the channel's unit; zero where the fit leaves a direction free.
pub(super) fn prediction_sd(laboratory: &Laboratory<'_>, fit: &Fitted<'_>) -> Vec<f64> {
    let Ok(optimum) = fit.optimum() else { return vec![0.0; laboratory.rows.rows.len()] };
    let mut variance = DVector::zeros(laboratory.rows.rows.len());
    for BlockRow { rows, columns, values } in fit.jacobian.in_blocks(&laboratory.rows).blocks() {
        let spread = values * optimum.covariance().select_rows(columns).select_columns(columns);
        for (k, i) in rows.clone().enumerate() {
            variance[i] = spread.row(k).dot(&values.row(k)).max(0.0);
        }
    }
    let own = |i: usize| if fit.own_values.is_empty() { 0.0 } else { fit.own_values.row(i).norm_squared() };
    let sd = |(i, row): (usize, &Row)| row.noise * (variance[i] + own(i)).sqrt();
    laboratory.rows.rows.iter().enumerate().map(sd).collect()
}

/// The effects of a version with their coefficients.
pub(super) fn effects(judged: &Judged<'_>) -> Vec<NamedEffect> {
    let version = &judged.fit.version;
    let estimates = estimates(judged);
    let of_member = |(m, member): (usize, &super::version::Member<'_>)| {
        let def = &member.candidate.def;
        let coefficient = |(k, parameter): (usize, &starlings_models::effect::EffectParameter)| {
            let Estimate { estimate, sd, interval95, .. } = estimates[version.first_of(m) + k];
            let (name, unit) = (parameter.name.clone(), parameter.unit.clone());
            Coefficient { name, unit, estimate, sd, interval95 }
        };
        NamedEffect {
            name: def.name.clone(),
            says: def.says.clone(),
            adds: def.adds.iter().map(|a| (a.to.clone(), a.term.clone())).collect(),
            parameters: def.parameters.iter().enumerate().map(coefficient).collect(),
            confounders: def.confounders.clone(),
            source: def.source.clone(),
        }
    };
    version.members.iter().enumerate().map(of_member).collect()
}

/// The effects of a version as the new study writes them.
pub(super) fn patches(judged: &Judged<'_>) -> Vec<PatchEffect> {
    let named = effects(judged);
    let members = &judged.fit.version.members;
    let patch = |(member, named): (&super::version::Member<'_>, NamedEffect)| PatchEffect {
        def: member.candidate.def.clone(),
        values: named.parameters,
    };
    members.iter().zip(named).map(patch).collect()
}

/// Every candidate at its best point, with what became of it.
pub(super) fn screened(
    found: &Found<'_>,
    candidates: &[Candidate],
    decision: &Decision,
    n_train: usize,
) -> Vec<Screened> {
    let excess = found.before.train - n_train as f64;
    let one = |(index, candidate): (usize, &Candidate)| {
        let sign = candidate.sign();
        let of = found.hits.iter().filter(|h| h.candidate == index);
        let best = of.max_by(|a, b| {
            let key = |h: &Hit| (h.failure.is_none(), h.allowed_gain(sign), h.score.gain);
            key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
        })?;
        let inner = candidate.def.parameters.iter().skip(1).zip(&best.point);
        let at: Vec<String> = inner.map(|(p, v)| format!("{} = {v:.4}", p.name)).collect();
        Some(Screened {
            name: candidate.name().to_owned(),
            at: at.join(", "),
            share: if excess > 0.0 { (best.score.gain / excess).min(1.0) } else { 0.0 },
            gain: best.score.gain,
            amplitude: best.score.amplitude,
            identifiable: best.score.identifiable,
            fate: fate(found, decision, index, candidate, best),
        })
    };
    let mut all: Vec<Screened> = candidates.iter().enumerate().filter_map(one).collect();
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    all
}

fn fate(found: &Found<'_>, decision: &Decision, index: usize, candidate: &Candidate, best: &Hit) -> String {
    let named = decision.best.map(|i| found.judged[i].names()).unwrap_or_default();
    let is = |names: &[String]| names.iter().any(|n| n == candidate.name());
    let answered = matches!(decision.verdict, super::Verdict::Named | super::Verdict::Tie);
    let text = if answered && is(&named) {
        "named"
    } else if decision.tied.iter().any(|set| is(set)) {
        "tied"
    } else if let Some(reason) = &best.failure {
        return if reason.starts_with("no influence") {
            "no influence".to_owned()
        } else {
            "failed".to_owned()
        };
    } else if best.is_absorbed() {
        "absorbed by the parameters"
    } else if found.judged.iter().any(|j| j.fit.version.members.iter().any(|m| m.index == index)) {
        "refitted"
    } else if best.allowed_gain(candidate.sign()) > 0.0 || best.score.gain <= 0.0 {
        "not refitted"
    } else {
        "wrong sign"
    };
    text.to_owned()
}

/// Root mean square errors before and after, by record, channel and use.
pub(super) fn gap(laboratory: &Laboratory<'_>, before: &[f64], after: &[f64]) -> Vec<GapRow> {
    let study = laboratory.study;
    let mut list = Vec::new();
    for (r, record) in study.records.iter().enumerate() {
        for (c, channel) in record.channels.iter().enumerate() {
            for usage in [Usage::Train, Usage::HeldOut, Usage::HeldOutChannel] {
                let of = |row: &Row| row.record == r && row.channel == c && row.usage == usage;
                if laboratory.rows.rows.iter().any(&of) {
                    list.push(GapRow {
                        record: record.name.clone(),
                        channel: channel.output.clone(),
                        usage: usage.word().to_owned(),
                        before: laboratory.rows.rmse(before, of),
                        after: laboratory.rows.rmse(after, of),
                        noise: channel.noise,
                    });
                }
            }
        }
    }
    list
}

/// What is left of the gap after a fit; the form is that of the version whose form was `checked`.
pub(super) fn remaining(
    found: &Found<'_>,
    added: Option<&Judged<'_>>,
    checked: Option<&Judged<'_>>,
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
pub(super) fn false_alarm(found: &Found<'_>, best_gain: f64) -> FalseAlarm {
    let n = found.background.maxima.len() as f64;
    let rate = found.background.exceeding();
    let upper = wilson_upper(rate, n);
    FalseAlarm {
        rate,
        upper95: upper,
        how: format!(
            "{n:.0} simulations of the fitted model with white noise of the stated sd, the whole library scored on each to first \
             order, against a threshold from as many others; a candidate must then still pass the other gates, so the rate is an upper bound of the search's own"
        ),
        runs: found.background.maxima.len() as u64,
        threshold: found.background.threshold,
        decoys: found.background.decoys_above(best_gain),
        nulls: None,
    }
}

/// Upper end of the 95 % interval of a rate seen in n trials (Wilson 1927); 1 without any.
pub(super) fn wilson_upper(rate: f64, n: f64) -> f64 {
    let z2 = Z95 * Z95;
    if n > 0.0 {
        (rate + z2 / (2.0 * n) + Z95 * ((rate * (1.0 - rate) + z2 / (4.0 * n)) / n).sqrt()) / (1.0 + z2 / n)
    } else {
        1.0
    }
}

/// What the effects did to the model's own parameters.
pub(super) fn shifts(base: &Fitted<'_>, judged: &Judged<'_>) -> Vec<ParameterShift> {
    let (before, own) = (base.theta(), &base.version.study.theta);
    let shift = |after: Estimate| {
        let i = own.iter().position(|entry| entry.name == after.name)?;
        let Estimate { name, unit, estimate, sd, .. } = after;
        let before = own[i].transform.to_physical(before[i]);
        Some(ParameterShift { name, unit, before, after: estimate, sd })
    };
    estimates(judged).into_iter().take(judged.fit.version.n_own).filter_map(shift).collect()
}

/// Measured and simulated curves of every channel.
pub(super) fn curves(laboratory: &Laboratory<'_>, before: &[f64], after: Option<&[f64]>) -> Vec<Curve> {
    let study = laboratory.study;
    let mut list = Vec::new();
    for (r, record) in study.records.iter().enumerate() {
        for (c, channel) in record.channels.iter().enumerate() {
            let rows = laboratory
                .rows
                .rows
                .iter()
                .enumerate()
                .filter(|(_, row)| row.record == r && row.channel == c);
            let at: Vec<usize> = rows.map(|(i, _)| i).collect();
            let pick = |values: &[f64]| at.iter().map(|i| values[*i]).collect::<Vec<_>>();
            list.push(Curve {
                record: record.name.clone(),
                channel: channel.output.clone(),
                unit: unit(study, r, c),
                noise: channel.noise,
                held_out: channel.held_out,
                train: record.train_span(),
                time: at.iter().map(|i| laboratory.rows.rows[*i].time).collect(),
                observed: at.iter().map(|i| laboratory.rows.rows[*i].observed).collect(),
                before: pick(before),
                after: after.map(pick).unwrap_or_default(),
            });
        }
    }
    list
}
