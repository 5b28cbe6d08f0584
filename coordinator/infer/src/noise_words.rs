//! What is said of noise that is not what it is held to be: with a memory, of another form, with other errors of the measurement.
//!
//! Next file to read: `words.rs`.

use starlings_estimators::inference::{
    Estimate, NoiseCheck, NoiseForm, Place, Posterior, Structure, Sums, Verdict, increment_noise,
};
use starlings_models::units::rounded;

use crate::answer::Answer;

/// Standard deviations by which errors of the measurement are others than those that are given.
const SURELY: f64 = 3.0;
/// Factor from which a standard deviation of errors is another one.
const OTHER: f64 = 1.25;
/// Standard deviations of a coefficient from which an extrapolation went far.
const FAR: f64 = 1.0;
/// Share of the variance of neighbouring differences that makes errors of the measurement large: without a fit, smaller ones are uncertain.
const LARGE: f64 = 0.5;
/// Equations or coefficients that a warning names at most.
const NAMED: usize = 4;

/// Equations with something to infer in which neighbouring residuals are alike.
pub(crate) fn alike<'a>(
    checks: &'a [NoiseCheck],
    structure: &Structure,
) -> impl Iterator<Item = &'a NoiseCheck> {
    let is_asked = move |l: usize| {
        let at = |place: &Place| place.equation == l;
        structure.coefficients().iter().any(|c| c.places.iter().any(at))
    };
    let all = checks.iter().enumerate();
    all.filter(move |(l, check)| check.verdict == Verdict::Alike && is_asked(*l)).map(|(_, check)| check)
}

/// That the noise has a memory.
pub(crate) fn of_memory(alike: &[NoiseCheck], step: f64, unit: &str) -> Option<String> {
    if alike.is_empty() {
        return None;
    }
    let of = |check: &NoiseCheck| {
        let memory = check.memory().map_or_else(String::new, |steps| {
            format!(", a memory of about {} {unit}", rounded(steps * step, 2))
        });
        format!("{} (correlation {:.2}{memory})", check.equation, -check.ratio)
    };
    Some(format!(
        "neighbouring residuals are alike in {}: the noise is not white, or the drift lacks what moves slowly, or the recording was filtered; \
         coefficients are then wrong by more than their intervals, whatever the length of the recording and however short its steps; give the \
         noise a state of its own where it is measured, take every so many rows that their noise is new, or look for missing terms \
         ([infer.candidates])",
        alike.iter().map(of).collect::<Vec<_>>().join(", ")
    ))
}

/// That the noise has not the form that the study gives.
pub(crate) fn of_form(form: &str, answer: &Answer) -> Option<String> {
    let of = |departs: &NoiseForm| match departs {
        NoiseForm::Shared([a, b], correlation) => {
            format!("{a} and {b} share theirs (correlation {correlation:.2})")
        }
        NoiseForm::Unequal([a, b], [d_a, d_b]) => {
            format!("{a} has {} and {b} {}", rounded(*d_a, 3), rounded(*d_b, 3))
        }
    };
    let list: Vec<String> = answer.departs.iter().take(NAMED).map(of).collect();
    (!list.is_empty()).then(|| {
        format!(
            "the noise of the equations is not what diffusion = \"{form}\" holds it to be: {}; means of coefficients are freed of that, intervals \
             of coefficients in several equations are not: use diffusion = \"{}\"",
            list.join(", "),
            if answer.departs.iter().any(|d| matches!(d, NoiseForm::Shared(..))) { "full" } else { "diagonal" }
        )
    })
}

/// That errors of the measurement are others than those given: by residuals at lag one, or by neighbouring differences where there is no fit.
pub(crate) fn of_given(
    given: f64,
    checks: &[NoiseCheck],
    sums: Option<&Sums>,
    structure: &Structure,
) -> Option<String> {
    let is_other = |shown: f64| given > OTHER * shown || given * OTHER < shown;
    let by_fit = |check: &NoiseCheck| {
        let shown = check.measured.max(0.0).sqrt();
        let is_sure = (given * given - check.measured).abs() > SURELY * check.measured_sd()?;
        (is_sure && is_other(shown)).then(|| format!("{} ({})", check.equation, rounded(shown, 2)))
    };
    let by_differences = || {
        let all = sums.map(|sums| increment_noise(sums, structure)).unwrap_or_default();
        let hidden = all.into_iter().filter(|noise| noise.share > LARGE && is_other(noise.measured));
        hidden.map(|noise| format!("{} ({})", noise.equation, rounded(noise.measured, 2))).collect()
    };
    let list: Vec<String> =
        if checks.is_empty() { by_differences() } else { checks.iter().filter_map(by_fit).collect() };
    (!list.is_empty()).then(|| {
        format!(
            "measurement_noise = {given} is not what neighbouring rows show in {}, standard deviations: coefficients and noise are wrong by more \
             than their intervals where it is wrong; measurement_noise = \"auto\" tells what there is",
            list.join(", ")
        )
    })
}

/// That the extrapolation to no step went far.
pub(crate) fn of_extrapolation(answer: &Answer) -> Option<String> {
    let to = answer.extrapolated.as_ref()?;
    let far = |(of, to): (&Estimate, &Estimate)| {
        let (name, at, to) = (&of.name, of.value?, to.value?);
        let is_far = (to.mean - at.mean).abs() > FAR * at.sd;
        is_far.then(|| format!("{name} by {:.1}", (to.mean - at.mean) / at.sd))
    };
    let Posterior { estimates, .. } = &answer.posterior;
    let list: Vec<String> = estimates.iter().zip(&to.estimates).filter_map(far).take(NAMED).collect();
    (!list.is_empty()).then(|| {
        format!(
            "the extrapolation to no step moves coefficients far, {} of their standard deviations: what is left of the step's error may be as \
             large, and the noise is not extrapolated; record in shorter steps",
            list.join(", ")
        )
    })
}
