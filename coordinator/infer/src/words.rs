//! What is said of an inference: the verdict, what its intervals are conditional on, warnings.
//!
//! Next file to read: [`super::result`].

use starlings_estimators::inference::{NoiseCheck, StepError, Verdict};
use starlings_models::units::rounded;
use starlings_study::infer_choice::{InferChoice, MeasuredChoice};

use crate::answer::Answer;
use crate::coarse::Coarse;
use crate::constancy::Changed;
use crate::result::{CoefficientFound, MissingFound, NamedTerm, ReducedFound};

/// The result in one sentence.
pub(crate) fn verdict(
    n_step: u64,
    coefficients: &[CoefficientFound],
    reduced: Option<&ReducedFound>,
    missing: Option<&MissingFound>,
) -> String {
    let count = |which: &dyn Fn(&CoefficientFound) -> bool| coefficients.iter().filter(|c| which(c)).count();
    let unknown = count(&|c| !c.observed);
    let zero = count(&|c| c.observed && c.may_be_zero == Some(true));
    let given = coefficients.len() - unknown;
    let differ = match zero {
        0 => ", all of which differ from zero".to_owned(),
        1 => ", one of which may be zero".to_owned(),
        n => format!(", {n} of which may be zero"),
    };
    let unseen = if unknown > 0 { format!("; {unknown} not observed") } else { String::new() };
    let reduced = reduced.map_or_else(String::new, |reduced| {
        let agrees = if reduced.consistent { "agrees with them" } else { "is refuted by them" };
        format!(
            "; the reduced model of {} {agrees} (χ² {:.1} for {} degrees of freedom, probability {})",
            plural(reduced.unknowns.len(), "unknown"),
            reduced.chi_squared,
            reduced.degrees,
            probability(reduced.probability)
        )
    });
    let of = plural(coefficients.len(), "coefficient");
    let missing = missing.map_or_else(String::new, lacks);
    format!("{n_step} steps give {given} of {of}{differ}{unseen}{reduced}{missing}")
}

/// What the drift lacks, as the end of the verdict.
fn lacks(missing: &MissingFound) -> String {
    let of = plural(missing.candidates, "candidate");
    if missing.named.is_empty() {
        return format!("; of {of} no term is missing");
    }
    let name = |named: &NamedTerm| {
        let ties =
            if named.ties.is_empty() { String::new() } else { format!(" (or {})", named.ties.join(", ")) };
        format!("{}{ties}", named.name)
    };
    let names: Vec<String> = missing.named.iter().map(name).collect();
    format!("; of {of} the drift lacks {}", names.join(", "))
}

pub(crate) fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

fn probability(p: f64) -> String {
    if p < 1e-3 { format!("{p:.0e}") } else { format!("{p:.2}") }
}

/// What has to be right for the intervals to be.
pub(crate) fn conditional_on(choice: &InferChoice, answer: &Answer) -> String {
    let drift = if choice.sums.unknown.is_empty() {
        "the drift is a combination of these functions"
    } else {
        "the rates are those of the study"
    };
    let measured = match choice.measured {
        MeasuredChoice::Known(sd) => format!(
            "at the smoothed path under errors of the measurement of {sd}, whose own uncertainty they do not hold"
        ),
        _ if choice.resample => {
            "at rows that were interpolated to equal steps, whose effect on the functions they do not hold".to_owned()
        }
        _ if answer.fit.lag_corrected => {
            "with the noise freed of errors of the measurement, whose effect on the functions they do not hold".to_owned()
        }
        _ => "without errors of the measurement".to_owned(),
    };
    let step = match &answer.extrapolated {
        Some(_) => "extrapolated to no sampling step",
        None => "the error of the sampling step is not in them",
    };
    let white = if answer.widened().is_some() {
        "white, of any size in each step (the drift is that of Itô's equation)"
    } else {
        "white"
    };
    format!("90 % intervals, given that {drift} and that the noise is {white}, {measured}; {step}")
}

/// In what the estimates on the way differ from the table.
pub(crate) fn convergence_of(choice: &InferChoice, answer: &Answer) -> Option<String> {
    if let MeasuredChoice::Known(_) = choice.measured {
        return Some("estimates from the recording as it was measured, before smoothing".to_owned());
    }
    if answer.widened().is_some() {
        return Some("estimates that take the noise for constant".to_owned());
    }
    let extrapolated = answer.extrapolated.as_ref();
    extrapolated.map(|_| "estimates at the sampling step, before the extrapolation to none".to_owned())
}

/// What is doubtful about terms that were named or not.
fn of_missing(missing: &MissingFound) -> Vec<String> {
    let mut warnings = Vec::new();
    if !missing.named.is_empty() {
        let text = "the drift lacks terms: its coefficients are those of the model as it is, and move when these are added";
        warnings.push(text.to_owned());
    }
    if let Some(left) = missing.left.as_ref().filter(|left| left.by_chance < missing.false_alarm) {
        let beside = if missing.named.is_empty() { "" } else { " and the named terms" };
        warnings.push(format!(
            "all candidates together explain more beside the model{beside} than chance does (χ² {:.1} for {}, probability {}), and none \
             alone is sure: record longer, or give other candidates",
            left.chi_squared,
            plural(left.terms, "term"),
            probability(left.by_chance)
        ));
    }
    if let Some(held_out) = missing.held_out.as_ref().filter(|h| !missing.named.is_empty() && h.gain <= 0.0) {
        warnings.push(format!(
            "held-out records are predicted no better with the named terms ({:.1} nats over {} steps): what was named may hold in the \
             other records only",
            held_out.gain, held_out.n_step
        ));
    }
    warnings
}

/// Coefficients that are named at most, those first that move most beside their intervals.
const MOVED: usize = 4;

/// That steps are coarse for the dynamics.
pub(crate) fn of_steps(coarse: &Coarse, step: f64, unit: &str) -> String {
    let begins = format!("steps of {step} {unit} are coarse for this dynamics:");
    let out = "without the error of the step coefficients would move out of their intervals, by the first rows of the recording";
    match coarse {
        Coarse::Moved(moved) => format!(
            "{begins} {out} {}; `richardson = true` in [infer] takes that out, shorter steps make it small",
            listed(moved)
        ),
        Coarse::Moving(moving) => format!(
            "{begins} {out} {} at least; four times the step has no fit, from which `richardson` could take it out: record in shorter steps",
            listed(moving)
        ),
        Coarse::Noise(moved) => format!(
            "{begins} what noise adds at mid-points is taken to first order of the step, and by the drift that was found coefficients \
             would move by the next one out of their intervals, {}; `richardson = true` in [infer] takes that out where longer steps have a fit, \
             shorter steps make it small",
            listed(moved)
        ),
        Coarse::Fast(rates) => format!(
            "{begins} a step is {rates:.1} times the fastest time of the drift that was found, whose rates are wrong by that; two or \
             four times the step has no fit, from which `richardson` could take it out: record at a tenth of that time"
        ),
    }
}

/// That the coefficients are not the same throughout.
pub(crate) fn of_change(changed: &Changed, record: &str, unit: &str) -> String {
    let Changed { name, from, by_chance, before: [before, sd_before], after: [after, sd_after], .. } =
        changed;
    let by_chance = if *by_chance < 1e-9 { "less than 1e-9".to_owned() } else { format!("{by_chance:.0e}") };
    format!(
        "the coefficients are not the same throughout: {name} is {} ± {} before {} {unit} of record `{record}` and {} ± {} from there on (by \
         chance with probability {by_chance}), and the table mixes both: infer from a span of them (`train`), or see when they change by \
         `--follow`; where nothing did, the drift lacks a term or the noise is larger in some states than in others",
        known_to(*before, *sd_before),
        rounded(*sd_before, 2),
        rounded(*from, 6),
        known_to(*after, *sd_after),
        rounded(*sd_after, 2),
    )
}

/// A value with two digits of its uncertainty.
fn known_to(value: f64, sd: f64) -> f64 {
    let digits = (value.abs() / sd).log10().floor() + 2.0;
    rounded(value, if digits.is_finite() { digits.clamp(1.0, 15.0) as usize } else { 6 })
}

/// A prior that the data contradict: by more than so many standard deviations of what the data add.
const CONTRADICTS: f64 = 4.0;
/// Share of a prior's variance that the data take away at least, where it is asked whether they contradict it.
const LITTLE: f64 = 1e-4;

/// Priors that the data contradict. The mean of the posterior lies from that of the prior by s₀² − s² of variance where both hold.
fn of_priors(coefficients: &[CoefficientFound]) -> Vec<String> {
    let of = |found: &CoefficientFound| {
        let ([mean, wide], estimate, sd) = (found.prior?, found.at_step.or(found.estimate)?, found.sd?);
        // Where the data say next to nothing, or errors of the measurement widen what is told, nothing contradicts.
        let moves = (wide * wide - sd * sd > LITTLE * wide * wide).then(|| (wide * wide - sd * sd).sqrt())?;
        let is_far = (estimate - mean).abs() > CONTRADICTS * moves;
        is_far.then(|| {
            format!(
                "the data contradict the prior of {}: the estimate is {:.1} of the prior's standard deviations from its mean {mean}, and what \
                 is shared with other coefficients moves these too; widen the prior or correct it",
                found.name,
                (estimate - mean).abs() / wide
            )
        })
    };
    coefficients.iter().filter_map(of).collect()
}

/// What would move, the furthest beside its interval first.
fn listed(moved: &[StepError]) -> String {
    let mut moved: Vec<_> = moved.iter().collect();
    moved.sort_by(|a, b| (b.moves / b.half).abs().total_cmp(&(a.moves / a.half).abs()));
    let said = |of: &&StepError| format!("{} by {:+.2e} (interval ± {:.2e})", of.name, of.moves, of.half);
    let mut list: Vec<String> = moved.iter().take(MOVED).map(said).collect();
    let more = moved.len().saturating_sub(MOVED);
    if more > 0 {
        list.push(format!("{more} more"));
    }
    list.join(", ")
}

/// Errors of the measurement; small ones where they moved coefficients.
fn of_errors(choice: &InferChoice, answer: &Answer) -> Option<String> {
    let is_told = |check: &&NoiseCheck| {
        check.verdict == Verdict::Matters || (answer.fit.lag_corrected && check.is_sure())
    };
    let of = |check: &NoiseCheck| {
        format!(
            "{} (ratio {:.3}, standard deviation about {:.2e})",
            check.equation,
            check.ratio,
            check.measured.max(0.0).sqrt()
        )
    };
    let list: Vec<String> = answer.checks.iter().filter(is_told).map(of).collect();
    if list.is_empty() || matches!(choice.measured, MeasuredChoice::Known(_)) {
        return None;
    }
    let done = if answer.fit.lag_corrected {
        "the noise was taken from neighbouring residuals, which frees it of them"
    } else {
        "measurement_noise = \"auto\" takes them out of the noise"
    };
    Some(format!(
        "neighbouring residuals show errors of the measurement in {}: {done}; where they are large give measurement_noise = <sd>, \
         which smooths",
        list.join(", ")
    ))
}

/// What is doubtful.
pub(crate) fn warnings(
    choice: &InferChoice,
    answer: &Answer,
    reduced: Option<&ReducedFound>,
    missing: Option<&MissingFound>,
) -> Vec<String> {
    let mut warnings = answer.doubts.clone();
    if choice.resample {
        warnings.push(
            "rows were interpolated to equal steps, which takes noise out of each: the noise was taken from neighbouring residuals, which \
             have it together"
                .to_owned(),
        );
    }
    warnings.extend(of_priors(&answer.coefficients(choice)));
    warnings.extend(of_errors(choice, answer));
    let unseen: Vec<&str> =
        answer.posterior.estimates.iter().filter(|e| !e.observed).map(|e| e.name.as_str()).collect();
    if !unseen.is_empty() {
        warnings
            .push(format!("not observed, since their functions were zero throughout: {}", unseen.join(", ")));
    }
    if !choice.prefactor {
        warnings.push(
            "prefactor = false leaves a bias of ½ D V Φ⁻¹ in the coefficients, which more data do not remove"
                .to_owned(),
        );
    }
    if let Some(missing) = missing {
        warnings.extend(of_missing(missing));
    }
    if let Some(reduced) = reduced.filter(|reduced| !reduced.consistent) {
        warnings.push(format!(
            "the reduced model is refuted (χ² {:.1} for {} degrees of freedom): its unknowns mean little",
            reduced.chi_squared, reduced.degrees
        ));
    }
    warnings
}
