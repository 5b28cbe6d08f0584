//! What is said of an inference: the verdict, what its intervals are conditional on, warnings.
//!
//! Next file to read: [`super::result`].

use starlings_estimators::inference::{NoiseCheck, Verdict};
use starlings_study::infer_choice::{InferChoice, MeasuredChoice};

use crate::answer::Answer;
use crate::result::{CoefficientFound, ReducedFound};

/// The result in one sentence.
pub(crate) fn verdict(
    n_step: u64,
    coefficients: &[CoefficientFound],
    reduced: Option<&ReducedFound>,
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
    format!("{n_step} steps give {given} of {of}{differ}{unseen}{reduced}")
}

fn plural(n: usize, what: &str) -> String {
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
        _ if answer.lag_corrected => {
            "with the noise freed of errors of the measurement, whose effect on the functions they do not hold".to_owned()
        }
        _ => "without errors of the measurement".to_owned(),
    };
    let step = match &answer.extrapolated {
        Some(_) => "extrapolated to no sampling step",
        None => "the error of the sampling step is not in them",
    };
    format!("90 % intervals, given that {drift} and that the noise is white, {measured}; {step}")
}

/// What is doubtful.
pub(crate) fn warnings(choice: &InferChoice, answer: &Answer, reduced: Option<&ReducedFound>) -> Vec<String> {
    let mut warnings = answer.doubts.clone();
    let noisy: Vec<&NoiseCheck> =
        answer.checks.iter().filter(|check| check.verdict == Verdict::Matters).collect();
    if !noisy.is_empty() && !matches!(choice.measured, MeasuredChoice::Known(_)) {
        let of = |check: &&NoiseCheck| {
            format!(
                "{} (ratio {:.2}, standard deviation about {:.2e})",
                check.equation,
                check.ratio,
                check.measured.max(0.0).sqrt()
            )
        };
        let list: Vec<String> = noisy.iter().map(of).collect();
        let done = if answer.lag_corrected {
            "the noise was taken from neighbouring residuals, which frees it of them"
        } else {
            "measurement_noise = \"auto\" takes them out of the noise"
        };
        warnings.push(format!(
            "neighbouring residuals show errors of the measurement in {}: {done}; where they are large give measurement_noise = <sd>, \
             which smooths",
            list.join(", ")
        ));
    }
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
    if let Some(reduced) = reduced.filter(|reduced| !reduced.consistent) {
        warnings.push(format!(
            "the reduced model is refuted (χ² {:.1} for {} degrees of freedom): its unknowns mean little",
            reduced.chi_squared, reduced.degrees
        ));
    }
    warnings
}
