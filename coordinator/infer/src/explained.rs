//! What an inference that looked for missing terms says as an explanation: a verdict, the terms, what they do to the model's coefficients.
//!
//! The words and keys are those of the explanation of a deterministic model where they mean the same. Next file to read: `missing.rs`.

use serde::Serialize;

use crate::result::{HeldOut, Inference, JointScore, MissingFound, ScoredTerm};

/// What the drift lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DriftVerdict {
    /// Terms are named, and nothing does as well in the place of any.
    Named,
    /// Terms are named, and other candidates do as well in the place of one.
    Tie,
    /// Something is left of the candidates' kind, and no term is named.
    Unexplained,
    /// No term is named, and nothing is left.
    NoGap,
}

/// An explanation of a drift.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftExplanation {
    /// Name of the study.
    pub study: String,
    /// The verdict.
    pub verdict: DriftVerdict,
    /// The verdict as a sentence.
    pub says: String,
    /// The terms that are named.
    pub effects: Vec<DriftEffect>,
    /// Per term, candidates that the data take as well in its place.
    pub tied_with: Vec<Vec<String>>,
    /// Candidates by themselves, the strongest first.
    pub strongest: Vec<ScoredTerm>,
    /// What is left of all candidates together beside the model and the named terms.
    pub remaining: Option<JointScore>,
    /// How often a term is named by chance.
    pub false_alarm: DriftFalseAlarm,
    /// How much better held-out records are predicted with the terms.
    pub held_out: Option<HeldOut>,
    /// Coefficients of the model without and with the terms.
    pub parameter_shifts: Vec<DriftShift>,
    /// The study with the terms in its drift, where one was written.
    pub explained_study: Option<String>,
    /// What is doubtful.
    pub warnings: Vec<String>,
}

/// A term.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftEffect {
    /// Equation and function.
    pub name: String,
    /// The equation's state, and the function.
    pub adds: [DriftAddition; 1],
    /// Its coefficient.
    pub parameters: [DriftCoefficient; 1],
    /// χ² of the coefficient against zero beside everything else that is named.
    pub chi_squared: f64,
    /// Probability of as much by chance, for this candidate alone.
    pub by_chance: f64,
}

/// Where a term enters.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DriftAddition {
    /// The state whose rate has it.
    pub to: String,
    /// The function.
    pub term: String,
}

/// A coefficient.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftCoefficient {
    /// Its name in the explained study, or that of the term.
    pub name: String,
    /// Posterior mean.
    pub estimate: f64,
    /// Posterior standard deviation.
    pub sd: f64,
    /// The 90 % interval.
    pub interval90: [f64; 2],
}

/// The rate of false alarms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DriftFalseAlarm {
    /// Probability of naming anything where nothing is missing.
    pub rate: f64,
    /// Candidates that share it.
    pub candidates: usize,
}

/// A coefficient of the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftShift {
    /// Its name.
    pub name: String,
    /// Without the terms.
    pub before: Option<f64>,
    /// With them.
    pub after: Option<f64>,
    /// Standard deviation with them.
    pub sd: Option<f64>,
}

/// The explanation in an inference; `None` where it looked for no term.
pub fn explained(found: &Inference) -> Option<DriftExplanation> {
    let missing = found.missing.as_ref()?;
    Some(DriftExplanation {
        study: found.study.clone(),
        verdict: verdict(missing),
        says: found.verdict.clone(),
        effects: missing.named.iter().map(effect).collect(),
        tied_with: missing.named.iter().map(|named| named.ties.clone()).collect(),
        strongest: missing.strongest.clone(),
        remaining: missing.left.clone(),
        false_alarm: DriftFalseAlarm { rate: missing.false_alarm, candidates: missing.candidates },
        held_out: missing.held_out.clone(),
        parameter_shifts: shifts(found, missing),
        explained_study: None,
        warnings: found.warnings.clone(),
    })
}

fn verdict(missing: &MissingFound) -> DriftVerdict {
    let is_left = missing.left.as_ref().is_some_and(|left| left.by_chance < missing.false_alarm);
    match missing.named.as_slice() {
        [] if is_left => DriftVerdict::Unexplained,
        [] => DriftVerdict::NoGap,
        named if named.iter().any(|named| !named.ties.is_empty()) => DriftVerdict::Tie,
        _ => DriftVerdict::Named,
    }
}

fn effect(named: &crate::result::NamedTerm) -> DriftEffect {
    // Names of states hold no colon.
    let (to, term) = named.name.split_once(':').unwrap_or((&named.name, "1"));
    DriftEffect {
        name: named.name.clone(),
        adds: [DriftAddition { to: to.to_owned(), term: term.to_owned() }],
        parameters: [DriftCoefficient {
            name: named.name.clone(),
            estimate: named.estimate,
            sd: named.sd,
            interval90: named.interval90,
        }],
        chi_squared: named.chi_squared,
        by_chance: named.by_chance,
    }
}

/// The coefficients of the model, as far as terms were named.
fn shifts(found: &Inference, missing: &MissingFound) -> Vec<DriftShift> {
    let of = |before: &crate::result::CoefficientFound| {
        let after = missing.coefficients.iter().find(|after| after.name == before.name)?;
        let (name, before) = (before.name.clone(), before.estimate);
        Some(DriftShift { name, before, after: after.estimate, sd: after.sd })
    };
    let named = !missing.named.is_empty();
    found.coefficients.iter().filter(|_| named).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::NamedTerm;

    fn missing(ties: Option<&[&str]>, left: f64) -> MissingFound {
        let named = ties.map(|ties| NamedTerm {
            name: "x2:x1*x3".to_owned(),
            estimate: -1.0,
            sd: 0.1,
            interval90: [-1.2, -0.8],
            chi_squared: 100.0,
            by_chance: 1e-20,
            ties: ties.iter().map(|tie| (*tie).to_owned()).collect(),
        });
        MissingFound {
            candidates: 21,
            false_alarm: 0.01,
            named: named.into_iter().collect(),
            strongest: Vec::new(),
            left: Some(JointScore { terms: 20, chi_squared: 10.0, by_chance: left }),
            held_out: None,
            coefficients: Vec::new(),
        }
    }

    #[test]
    fn the_verdict_follows_from_names_ties_and_what_is_left() {
        assert_eq!(verdict(&missing(None, 0.5)), DriftVerdict::NoGap);
        assert_eq!(verdict(&missing(None, 1e-6)), DriftVerdict::Unexplained);
        assert_eq!(verdict(&missing(Some(&[]), 1e-6)), DriftVerdict::Named);
        assert_eq!(verdict(&missing(Some(&["x1:x3"]), 0.5)), DriftVerdict::Tie);
    }

    #[test]
    fn a_term_is_taken_apart_into_its_equation_and_function() {
        let found = effect(&missing(Some(&[]), 0.5).named[0]);
        assert_eq!(found.adds, [DriftAddition { to: "x2".to_owned(), term: "x1*x3".to_owned() }]);
    }
}
