//! What a study says of an effect: plain data, checked when a setup is built.
//!
//! Next file to read: [`super::terms`].

use serde::{Deserialize, Serialize};

use super::Scale;

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
    /// Where the form of the terms comes from: author, year, place; empty when nobody said.
    pub source: String,
    /// Name of the built-in effect that stands for everything above except `name`; see [`mod@super::library`].
    pub built_in: Option<String>,
}

/// One term of an effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Addition {
    /// A state (the term adds to its rate), an output, an input or a parameter of the model (the term adds to its value); of
    /// several with that name, the first in this order. `output:NAME` is the output also where a state has its name.
    pub to: String,
    /// Expression in states, parameters, constants, inputs, outputs and `t`, in the unit of what it is added to (per time
    /// unit for a state). A term that adds to an input or a parameter may not use outputs, which follow from them.
    pub term: String,
}

/// What stands before the name of an output that a term adds to, where a state may have that name too.
pub(crate) const OUTPUT: &str = "output:";

impl Addition {
    /// Name of what the term adds to.
    pub(crate) fn quantity(&self) -> &str {
        self.to.strip_prefix(OUTPUT).unwrap_or(&self.to)
    }
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
    /// In what the range and the grid are counted.
    pub scale: Scale,
    /// Whether it is a width over which the term rounds a corner: at zero the term is what the effect's name says, so that neither this
    /// end of the range nor data that do not tell the width speak against the effect.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_rounding: bool,
    /// One plain sentence; may be empty.
    pub says: String,
}

impl Default for EffectParameter {
    fn default() -> Self {
        Self {
            name: String::new(),
            unit: String::new(),
            range: crate::bounds::unbounded(),
            grid: Vec::new(),
            scale: Scale::Absolute,
            is_rounding: false,
            says: String::new(),
        }
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
