//! Whether the noise has one size throughout, and intervals that hold where it has not.
//!
//! The test and the intervals are the estimators' (`estimators/src/inference/varying.rs` and `robust.rs` beside it), by pairs of steps that
//! the blocks bring along. Next file to read: `doubts.rs`, which asks, and says what it finds beside other doubts.

use starlings_estimators::inference::{Varying, With, varying};
use starlings_models::units::rounded;
use starlings_study::infer_choice::{InferChoice, MeasuredChoice};

use crate::answer::Answer;
use crate::gather::Gathered;
use crate::result::NoiseVaries;
use crate::run::Asked;

/// Probability of telling noise that varies in a recording in which it does not.
pub(crate) const FALSE_ALARM: f64 = 1e-3;
/// Ratio of noise up to which coarse steps, or errors of the measurement that matter, let it look as if it varied: of errors a drift of
/// slope f' brings (f'h)²/2 of their own variance with it, which differs from state to state.
const HIDDEN: f64 = 1.5;

/// The equations whose noise varies. The answer's intervals hold that from here on where they can: not where errors of the
/// measurement make neighbouring residuals one another's, or where the coefficients were extrapolated.
pub(crate) fn varies(
    asked: &Asked<'_>,
    answer: &mut Answer,
    gathered: &Gathered,
    is_coarse: bool,
) -> Vec<NoiseVaries> {
    let Asked { choice, question, .. } = asked;
    let (Some(sums), pairs) = (gathered.levels.first(), &gathered.pairs) else { return Vec::new() };
    if choice.resample || matches!(choice.measured, MeasuredChoice::Known(_)) {
        return Vec::new();
    }
    let is_noisy = answer.has_errors();
    let (basis, structure) = (&question.basis, &question.structure);
    let found = varying(pairs, basis, answer.posterior.drift(), sums.step(), FALSE_ALARM);
    let is_told = |found: &Varying| found.ratio > HIDDEN || !(is_coarse || is_noisy);
    let told: Vec<Varying> = found.unwrap_or_default().into_iter().filter(is_told).collect();
    if !told.is_empty()
        && !is_noisy
        && answer.extrapolated.is_none()
        && let Ok(robust) = answer.fit.robust(&answer.posterior, pairs, (basis, structure), sums.step())
    {
        answer.take_robust(robust, (2 * pairs.n_pair() as u64, sums.n_step()));
    }
    let inputs = asked.setup.model.equations.iter().flat_map(|equations| &equations.inputs);
    let names: Vec<&String> = structure.equations().iter().chain(inputs.map(|input| &input.name)).collect();
    let one = |found: Varying| NoiseVaries {
        equation: structure.equations()[found.equation].clone(),
        with: match found.with {
            With::Channel(channel) => names.get(channel).map(|name| (*name).clone()),
            With::Course => None,
        },
        at: found.at,
        ratio: found.ratio.is_finite().then_some(found.ratio),
        chi_squared: found.chi_squared,
        by_chance: found.by_chance,
    };
    told.into_iter().map(one).collect()
}

/// What is said of it.
pub(crate) fn said(varies: &[NoiseVaries], choice: &InferChoice, answer: &Answer) -> Option<String> {
    let list: Vec<String> = varies.iter().map(one).collect();
    if list.is_empty() {
        return None;
    }
    let intervals = match answer.widened() {
        Some([least, most]) => format!(
            "the intervals of the coefficients allow for it ({} as wide as without), and coefficients of curved functions were freed of what \
             it moves them by{}",
            between(least, most),
            known_from(answer.sampled())
        ),
        None => "the intervals of the coefficients take it for constant and hold the truth less often than they say, and coefficients \
                 of curved functions are off"
            .to_owned(),
    };
    let missing = if choice.missing.is_some() { ", χ² of missing terms" } else { "" };
    Some(format!(
        "the noise is not constant: {}; {intervals}. The noise that is told is its mean; its interval{missing} and a forecast take it \
         for constant. Write the model in log(x) if the noise grows as x",
        list.join(", ")
    ))
}

/// From how many steps that is known, where it is not from most.
fn known_from(sampled: Option<u64>) -> String {
    let one =
        |n| format!(", which is known from {n} steps only: longer recordings do not narrow these intervals");
    sampled.map(one).unwrap_or_default()
}

/// Where the noise of an equation is how large.
fn one(found: &NoiseVaries) -> String {
    let NoiseVaries { equation, at: [from, to], ratio, by_chance, .. } = found;
    let chance = if *by_chance < 1e-9 { "less than 1e-9".to_owned() } else { format!("{by_chance:.0e}") };
    let (from, to) = match &found.with {
        Some(name) => {
            (format!("at {name} = {}", rounded(*from, 3)), format!("at {name} = {}", rounded(*to, 3)))
        }
        None => (format!("after {:.0} % of the rows", 100.0 * from), format!("after {:.0} %", 100.0 * to)),
    };
    let what = match ratio {
        Some(ratio) => format!("that of {equation} is {} times as large {to} as {from}", rounded(*ratio, 2)),
        None => format!("{equation} has none at all {from}, but {to}"),
    };
    format!("{what} (by chance with probability {chance})")
}

/// Two ratios as words.
fn between(least: f64, most: f64) -> String {
    let [least, most] = [rounded(least, 2), rounded(most, 2)];
    if most > least { format!("{least} to {most} times") } else { format!("{most} times") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_without_any_noise_is_told_so_and_read_again() {
        let varies = |ratio| NoiseVaries {
            equation: "x".to_owned(),
            with: None,
            at: [0.05, 0.95],
            ratio,
            chi_squared: 900.0,
            by_chance: 0.0,
        };
        let none = varies(None);
        assert!(one(&none).starts_with("x has none at all after 5 % of the rows, but after 95 % (by chance"));
        let ratio = one(&varies(Some(2.5)));
        assert!(
            ratio.starts_with("that of x is 2.5 times as large after 95 % as after 5 % of the rows"),
            "{ratio}"
        );
        let read: NoiseVaries = serde_json::from_str(&serde_json::to_string(&none).unwrap_or_default())
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(read, none);
    }
}
