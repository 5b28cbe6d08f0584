//! A named effect in words: its sentence, its equations, its coefficients, and the experiment that would decide a tie.

use serde::Serialize;
use starlings_explain::result::{Coefficient, Experiment, NamedEffect};

use crate::number::{self, quantity};

/// An effect, ready to be arranged.
#[derive(Debug, Serialize)]
pub(super) struct EffectView {
    name: String,
    says: String,
    equations: Vec<String>,
    coefficients: Vec<CoefficientView>,
    confounders: String,
    source: String,
}

#[derive(Debug, Serialize)]
struct CoefficientView {
    name: String,
    estimate: String,
    sd: String,
    interval: String,
    unit: String,
}

impl EffectView {
    /// Formats `effect`; `states` are the states of the model.
    pub(super) fn new(effect: &NamedEffect, states: &[String]) -> Self {
        Self {
            name: effect.name.clone(),
            says: effect.says.clone(),
            equations: effect.equations(states),
            coefficients: effect.parameters.iter().map(coefficient).collect(),
            confounders: effect.confounders.join(", "),
            source: effect.source.clone(),
        }
    }
}

fn coefficient(c: &Coefficient) -> CoefficientView {
    let digits = |value| number::with_sd(value, c.sd);
    let [lo, hi] = c.interval95;
    CoefficientView {
        name: c.name.clone(),
        estimate: digits(c.estimate),
        sd: number::significant(c.sd, 2),
        interval: format!("{} to {}", digits(lo), digits(hi)),
        unit: c.unit.clone(),
    }
}

/// All experiments that were simulated.
pub(super) fn experiments(experiment: &Experiment) -> Vec<[String; 2]> {
    experiment.tried.iter().map(|(what, separation)| [what.clone(), quantity(*separation, "")]).collect()
}
