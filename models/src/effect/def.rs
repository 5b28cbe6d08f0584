//! What a study says of an effect: plain data, checked when a setup is built.
//!
//! Next file to read: [`super::terms`].

use serde::{Deserialize, Serialize};

/// An effect as data: written out in a study, or the name of a built-in one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EffectDef {
    /// Name, unique in the study.
    pub name: String,
    /// One plain sentence.
    pub says: String,
    /// The terms, and where each is added.
    pub adds: Vec<Addition>,
    /// Its parameters. The first is the amplitude: at zero the effect is absent.
    pub parameters: Vec<EffectParameter>,
    /// States of its own (memory).
    pub states: Vec<EffectState>,
    /// Names of effects or parameters that can look the same in data.
    pub confounders: Vec<String>,
    /// Name of the built-in effect that stands for everything above except `name`; see [`mod@super::library`].
    pub built_in: Option<String>,
}

/// One term of an effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Addition {
    /// A state (the term adds to its rate), an output or an input (the term adds to its value); a name that is both a
    /// state's and an output's is the state.
    pub to: String,
    /// Expression in states, parameters, constants, inputs, outputs and `t`, in the unit of what it is added to (per time
    /// unit for a state).
    pub term: String,
}

/// A parameter of an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EffectParameter {
    /// Name, unique among the model's quantities.
    pub name: String,
    /// Unit label; empty when dimensionless or unknown.
    pub unit: String,
    /// Smallest and largest value that physics allows; a fit at its edge is refused.
    #[serde(with = "crate::bounds")]
    pub range: [f64; 2],
    /// Values to try when screening, for a parameter inside a term; its middle entry is the default.
    pub grid: Vec<f64>,
}

impl Default for EffectParameter {
    fn default() -> Self {
        Self { name: String::new(), unit: String::new(), range: crate::bounds::unbounded(), grid: Vec::new() }
    }
}

/// A state that an effect brings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EffectState {
    /// Name, unique among the model's quantities.
    pub name: String,
    /// Unit label.
    pub unit: String,
    /// Initial value: expression in parameters and constants. Empty means zero.
    pub initial: String,
    /// Rate: expression as in [`Addition::term`].
    pub rate: String,
}
