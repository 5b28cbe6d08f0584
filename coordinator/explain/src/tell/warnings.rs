//! The warnings of an explanation: what in it is doubtful.
//!
//! Next file to read: [`super::words`].

use starlings_models::{BuildSetup, SOLVER};
use starlings_study::{FAR_FROM_PRIOR, Study, listed as joined};

use super::correlated;
use crate::fit::candidate::Candidate;
use crate::fit::fitted_variant::FittedVariant;
use crate::fit::kind::Kind;
use crate::judge::adequacy::Nature;
use crate::judge::contribution::DISCREPANT;
use crate::judge::gates::JudgedFit;
use crate::judge::held_out::{HeldOut, listed};
use crate::judge::search_result::SearchResult;
use crate::judge::verdict::{Decision, Verdict};
use crate::number::times;
use crate::rows::Usage;
use crate::run_cache::RunCache;
use crate::screen::not_tried;

/// Distance in noise sd within which two simulated values are the same.
const SAME: f64 = 0.01;

/// The warning of a fit that has not converged, or has no measured Jacobian.
fn unfinished(fit: &FittedVariant<'_>) -> Option<String> {
    let name = fit.variant.name();
    if !fit.has_converged() {
        return Some(format!(
            "the fit with {name} has not converged after {} steps: its figures are those of where it stands",
            fit.trials()
        ));
    }
    (!fit.is_fresh()).then(|| {
        format!(
            "the fit with {name} ended without a measured Jacobian: its standard deviations and intervals rest on a secant \
             approximation"
        )
    })
}

/// The warning of rivals that simulate the same values as the variant that is shown.
fn same(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    decision: &Decision,
    judged: &JudgedFit<'_>,
) -> Option<String> {
    let own = cache.rows.scaled(&judged.fit.predicted);
    let alike = |i: &&usize| {
        let other = cache.rows.scaled(&found.judged[**i].fit.predicted);
        own.iter().zip(&other).all(|(a, b)| (a - b).abs() < SAME)
    };
    let names: Vec<String> = decision
        .rivals
        .iter()
        .filter(alike)
        .map(|i| format!("`{}`", found.judged[*i].fit.variant.name()))
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "`{}` and {} simulate the same values to {SAME} of the noise: as far as these data go they are one effect under \
             several names",
            judged.fit.variant.name(),
            names.join(" and ")
        )
    })
}

/// The warning of held-out data that fail although an effect is named.
fn still_failing(judged: &JudgedFit<'_>) -> Option<String> {
    let failing: Vec<&HeldOut> = judged.held_out.iter().filter(|h| h.fails).collect();
    (!failing.is_empty()).then(|| {
        format!(
            "held out and failing with `{}`: {}; it is not all that is missing",
            judged.fit.variant.name(),
            listed(&failing)
        )
    })
}

/// That the model as it is had to go far from its priors: an influence measured there may be another than where the model holds.
fn far_from_prior(base: &FittedVariant<'_>) -> Option<String> {
    let names = base.z().iter().zip(&base.variant.study.theta).filter(|(z, _)| z.abs() > FAR_FROM_PRIOR);
    let far: Vec<String> = names.map(|(z, entry)| format!("{} ({:.1})", entry.name, z.abs())).collect();
    (!far.is_empty()).then(|| {
        format!(
            "the model as it is comes nearest to the data far from its priors, in prior standard deviations: {}. Effects were scored at these \
             values; narrower priors keep the model where it is meant",
            joined(&far)
        )
    })
}

/// The noise whose size the residuals alone tell, where the search was made in units of it; else what could be such a noise: of the model as it
/// is where nothing explains the gap, else of what is told or came nearest.
fn larger_noise(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    decision: &Decision,
    best: Option<&JudgedFit<'_>>,
) -> Vec<String> {
    let assumed = correlated::assumed(&correlated::correlated_noise(cache.study, &cache.rows));
    if !assumed.is_empty() {
        return assumed;
    }
    let of = |fit: &FittedVariant<'_>, name: &str| {
        correlated::larger(cache.study, &cache.rows, &fit.predicted, name)
    };
    let as_it_is = (decision.verdict == Verdict::Unexplained).then(|| of(&found.base, "the model as it is"));
    let told = || best.map(|judged| of(&judged.fit, &format!("`{}`", judged.fit.variant.name())));
    as_it_is.filter(|said| !said.is_empty()).or_else(told).unwrap_or_default()
}

/// Whether there is a gap and no effect of a field explains it.
fn is_without_physics(found: &SearchResult<'_>, decision: &Decision) -> bool {
    let told = decision.best.filter(|_| matches!(decision.verdict, Verdict::Named | Verdict::Tie));
    let of_fields = |i: usize| found.judged[i].kinds().into_iter().all(Kind::is_of_a_field);
    decision.verdict != Verdict::NoGap && !told.is_some_and(of_fields)
}

/// What is doubtful in the candidates that were tried.
pub(crate) fn of_candidates(study: &Study, candidates: &[Candidate]) -> Vec<String> {
    let is_tried = |name: &String| candidates.iter().any(|candidate| candidate.name() == name);
    let told = study.candidate_warnings.iter().filter(|(name, _)| is_tried(name));
    told.map(|(_, warning)| warning.clone()).collect()
}

/// All warnings.
pub(crate) fn warnings(
    cache: &RunCache<'_>,
    found: &SearchResult<'_>,
    candidates: &[Candidate],
    decision: &Decision,
) -> Vec<String> {
    let mut list = Vec::new();
    if found.cut_short {
        list.push(format!(
            "the budget ended the search after {} runs: candidates named under `untried` were not refitted",
            cache.runs()
        ));
    }
    if !cache.rows.rows.iter().any(|row| row.usage != Usage::Train) {
        list.push(
            "nothing is held out: neither a span nor a channel could speak against a name; set `train` or \
             `hold_out_channels`"
                .to_owned(),
        );
    }
    if decision.verdict != Verdict::NoGap && cache.study.setup.model.kind == SOLVER {
        let why = "the unknown input of every equation was not looked for: the rates of a solver are not open to one";
        list.push(why.to_owned());
    }
    if cache.study.setup.is_noisy() {
        let why = "effects are scored on the rates alone, without the states' `noise`: which terms the drift of the stochastic equations \
                   lacks is asked with [infer.candidates] by `starlings infer`, or by `explain` of a study with `[infer]`, which count that noise";
        list.push(why.to_owned());
    }
    if matches!(found.adequacy.nature(), Nature::Smaller | Nature::Larger) || found.adequacy.is_numerical() {
        list.push(format!(
            "check the noise: the residuals of the model as it is are {} the stated one",
            times(found.adequacy.rmse_over_noise)
        ));
    }
    if is_without_physics(found, decision) {
        list.extend(not_tried::without_roles(cache.study, candidates));
    }
    if decision.verdict != Verdict::NoGap {
        list.extend(far_from_prior(&found.base));
    }
    let best = decision.best.map(|i| &found.judged[i]);
    list.extend(larger_noise(cache, found, decision, best));
    list.extend(best.and_then(|judged| unfinished(&judged.fit)));
    if let Some(judged) = best.filter(|j| j.inflation > 3.0) {
        let name = judged.fit.variant.name();
        list.push(format!(
            "with `{name}` {}: evidence and intervals are scaled by their effective variance, {:.1}",
            judged.adequacy.says(),
            judged.inflation
        ));
    }
    list.extend(best.filter(|_| decision.verdict != Verdict::Unexplained).and_then(still_failing));
    list.extend(best.and_then(|judged| same(cache, found, decision, judged)));
    if let Some(judged) =
        best.filter(|j| j.inflation > DISCREPANT && decision.verdict != Verdict::Unexplained)
    {
        list.push(format!(
            "what `{}` leaves is a discrepancy of its own and no noise: whether another form of it would serve as well was not \
             tested",
            judged.fit.variant.name()
        ));
    }
    list
}
