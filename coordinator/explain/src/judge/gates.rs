//! The gates: the tests that a refitted variant must pass before it may be named.
//!
//! Sign and range of its coefficients, the held-out span, the held-out channels, and evidence in units of the effective noise
//! against what a search over the whole library finds by chance. A lower error alone is no reason to name an effect. Next
//! file to read: [`super::search_result`].

use starlings_estimators::End;
use starlings_models::units::spaced;
use starlings_study::listed;

use super::adequacy::Adequacy;
use super::form::Leftover;
use super::held_out::{HeldOut, held_out};
use super::misfit::Misfit;
use super::range::at_edge;
use super::uncertainty::allowances;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::kind::Kind;
use crate::number::{three, times};
use crate::rows::{Row, Usage, unit};
use crate::run_cache::RunCache;

/// Factor by which a held-out error may grow without counting as worse.
const WORSE: f64 = 1.02;

/// Why a variant may not be named.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Refusal {
    /// The gate.
    pub gate: &'static str,
    /// Why, in words with numbers.
    pub reason: String,
}

impl Refusal {
    /// Whether the fit is no version that could be told: it failed, or a coefficient has the wrong sign or ends at the end of its range.
    pub(crate) fn is_impossible(&self) -> bool {
        matches!(self.gate, "failed" | "sign" | "range")
    }
}

/// A refitted variant with the figures for and against it.
#[derive(Clone, Debug)]
pub(crate) struct JudgedFit<'c> {
    /// The fit.
    pub fit: FittedVariant<'c>,
    /// Its misfit.
    pub misfit: Misfit,
    /// Factor on the variance of its residuals.
    pub inflation: f64,
    /// Its training residuals against the stated noise.
    pub adequacy: Adequacy,
    /// Its errors on held-out data, by record and channel.
    pub held_out: Vec<HeldOut>,
    /// Fall of χ² against the model as it is, training rows, less the price of parameters inside its terms and of further
    /// effects.
    pub gain: f64,
    /// Fall of χ² on the held-out span.
    pub gain_held_out: f64,
    /// Part of the χ² of the held-out span and the channels that are never fitted that a fit of all data would take away, to first
    /// order: what the uncertainty of the estimate explains.
    pub allowance_unseen: f64,
    /// Fall of χ² on the channels that are never fitted.
    pub gain_channels: f64,
    /// Share of the excess χ² that it takes away, training rows.
    pub share: f64,
    /// The same on the held-out span; `None` without one that has an excess.
    pub share_held_out: Option<f64>,
    /// Share of that excess which neither the variant, nor the uncertainty of its estimate, nor noise (two of its standard
    /// deviations) accounts for.
    pub unaccounted: f64,
    /// Why it may not be named.
    pub refusal: Option<Refusal>,
    /// The fall of χ² that candidates and modulated forms would still bring, where the second pass measured it.
    pub leftover: Option<Leftover>,
}

impl JudgedFit<'_> {
    /// Names of its effects.
    pub(crate) fn names(&self) -> Vec<String> {
        self.fit.variant.effects.iter().map(|m| m.candidate.name().to_owned()).collect()
    }

    /// Fall of χ² in units of its own effective noise.
    pub(crate) fn evidence(&self) -> f64 {
        self.gain / self.inflation
    }

    /// The kinds of its effects, the least likely first.
    pub(crate) fn kinds(&self) -> Vec<Kind> {
        let mut kinds: Vec<Kind> = self.fit.variant.effects.iter().map(|m| m.candidate.kind).collect();
        kinds.sort_by(|a, b| b.cmp(a));
        kinds
    }

    /// What the prior takes from its support, in χ².
    pub(crate) fn prior(&self) -> f64 {
        self.inflation * self.fit.variant.effects.iter().map(|m| m.candidate.kind.price()).sum::<f64>()
    }

    /// Its rank less what the prior takes: the order of what passes the gates.
    pub(crate) fn standing(&self) -> f64 {
        self.rank() - self.prior()
    }

    /// Fall of χ² on the training rows, the held-out span and the held-out channels, for ranking. The part of the χ² of both that the
    /// uncertainty of the estimate explains does not count against it.
    pub(crate) fn rank(&self) -> f64 {
        self.gain + self.gain_held_out + self.gain_channels + self.allowance_unseen
    }
}

/// Judges a variant against the model as it is. `threshold` is the gain that a search reaches by chance.
pub(crate) fn judge<'c>(
    cache: &RunCache<'_>,
    base: &FittedVariant<'_>,
    before: Misfit,
    fit: FittedVariant<'c>,
    threshold: f64,
) -> JudgedFit<'c> {
    let misfit = Misfit::of(cache, &fit);
    let m = cache.rows.train.len() as f64;
    let adequacy = Adequacy::of(cache, &fit);
    let inflation = adequacy.inflation;
    // The price of a parameter inside a term is ln n (Schwarz 1978), with n the number of independent values.
    let price = fit.variant.n_inner() as f64 * (m / inflation).max(3.0).ln();
    // The price of a further effect is the gain that a search reaches by chance.
    let further = fit.variant.effects.len().saturating_sub(1) as f64 * threshold * inflation;
    let gain = before.train - misfit.train - price - further;
    let gain_held_out = before.held_out - misfit.held_out;
    let share = ratio(before.train - misfit.train, before.train - m);
    let n_held = misfit.n_held_out as f64;
    let sd = chi_squared_sd(misfit.n_held_out, cache.rows.noise_freedom(|row| row.usage == Usage::HeldOut));
    let has_excess = before.held_out > n_held + 3.0 * sd;
    let share_held_out =
        (misfit.n_held_out > 0 && has_excess).then(|| ratio(gain_held_out, before.held_out - n_held));
    let [allowance, allowance_unseen] = allowances(cache, &fit);
    let held_out = held_out(cache, base, &fit);
    let beyond = misfit.held_out - allowance - n_held - 2.0 * sd;
    let unaccounted = if has_excess { ratio(beyond.max(0.0), before.held_out - n_held) } else { 0.0 };
    let mut judged = JudgedFit {
        fit,
        misfit,
        inflation,
        adequacy,
        held_out,
        gain,
        gain_held_out,
        allowance_unseen,
        gain_channels: before.channels - misfit.channels,
        share,
        share_held_out,
        unaccounted,
        refusal: None,
        leftover: None,
    };
    judged.refusal = refusal(cache, base, before, &judged, threshold);
    judged
}

/// Standard deviation of the χ² of n values of noise whose variance is known with so many degrees of freedom, to first order in their
/// inverse: that of χ² itself, and n times the relative sd √(2/freedom) of the variance.
fn chi_squared_sd(n: usize, freedom: f64) -> f64 {
    let n = n as f64;
    (2.0 * n + 2.0 * n * n / freedom).sqrt()
}

fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { (part / whole).clamp(-1.0, 1.0) } else { 0.0 }
}

/// The first gate that a variant does not pass.
fn refusal(
    cache: &RunCache<'_>,
    base: &FittedVariant<'_>,
    before: Misfit,
    judged: &JudgedFit<'_>,
    threshold: f64,
) -> Option<Refusal> {
    if matches!(judged.fit.end(), Some(End::NoStart)) {
        return Some(Refusal { gate: "failed", reason: "the model fails with it".to_owned() });
    }
    if judged.fit.optimum().is_err() {
        let reason = "with it the data leave a direction of the parameters free".to_owned();
        return Some(Refusal { gate: "failed", reason });
    }
    held_out_channel(cache, base, &judged.fit)
        .or_else(|| held_out_span(before, judged))
        .or_else(|| at_edge(&judged.fit))
        .or_else(|| {
            (judged.evidence() <= threshold)
                .then(|| Refusal { gate: "evidence", reason: too_weak(judged, threshold) })
        })
        .or_else(|| {
            (judged.standing() <= threshold * judged.inflation)
                .then(|| Refusal { gate: "evidence", reason: too_unlikely(judged, threshold) })
        })
}

/// That all data together speak for a variant no more than chance does, or not enough to make up for how unlikely its effects are before
/// any data, in words.
fn too_unlikely(judged: &JudgedFit<'_>, threshold: f64) -> String {
    let [rank, price] = [judged.rank(), judged.prior()].map(|of| of / judged.inflation);
    let chance = format!("a search like this one reaches {threshold:.1} by chance");
    if rank <= threshold {
        return format!(
            "what was held out takes away what the training data bring: in units of the effective noise both are {rank:.1}, where {chance}"
        );
    }
    let mut kinds: Vec<&str> = judged.kinds().into_iter().map(Kind::plural).collect();
    kinds.dedup();
    format!(
        "all data together speak for it with {rank:.1} in units of the effective noise, of which {price:.1} make up for how unlikely {} are \
         before any data; {chance}, so that nothing being missing stays likelier",
        listed(&kinds)
    )
}

/// That the fall of χ² is not more than chance reaches, in words.
fn too_weak(judged: &JudgedFit<'_>, threshold: f64) -> String {
    if judged.gain <= 0.0 {
        return "χ² less the price of its parameters does not fall".to_owned();
    }
    format!(
        "χ² falls by {:.1}, which in units of the effective noise ({:.1}) is {:.1}; a search like this one reaches {threshold:.1} \
         by chance",
        judged.gain,
        judged.inflation,
        judged.evidence()
    )
}

/// The refusal for a held-out span that gets worse.
fn held_out_span(before: Misfit, judged: &JudgedFit<'_>) -> Option<Refusal> {
    let after = judged.misfit;
    let n = after.n_held_out as f64;
    let size = |chi2: f64| times((chi2 / n).sqrt());
    let slack = 3.0 * (2.0 * n).sqrt().min(before.held_out);
    let worse = after.n_held_out > 0
        && after.held_out > before.held_out * WORSE * WORSE
        && after.held_out > before.held_out + slack.min(n);
    worse.then(|| Refusal {
        gate: "held-out span",
        reason: format!(
            "the error of the held-out span grows from {} to {} the noise",
            size(before.held_out),
            size(after.held_out)
        ),
    })
}

/// The refusal for a held-out channel that gets worse.
fn held_out_channel(
    cache: &RunCache<'_>,
    base: &FittedVariant<'_>,
    fit: &FittedVariant<'_>,
) -> Option<Refusal> {
    let rows = &cache.rows;
    for (output, name) in cache.study.setup.outputs.iter().enumerate() {
        let of = |row: &Row| row.output == output && row.usage == Usage::HeldOutChannel;
        let Some(row) = rows.rows.iter().find(|row| of(row)) else { continue };
        let (before, after) = (rows.rmse(&base.predicted, of), rows.rmse(&fit.predicted, of));
        if after > before * WORSE {
            return Some(Refusal {
                gate: "held-out channel",
                reason: format!(
                    "the error of {name}, which is never fitted, grows from {} to {}{}",
                    three(before),
                    three(after),
                    spaced(&unit(cache.study, row.record, row.channel))
                ),
            });
        }
    }
    None
}
