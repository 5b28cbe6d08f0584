//! What the jobs of a dynamical inference sum over their rows: functions of the model's states and inputs, as plain data.
//!
//! Such a job has a row per time in [`crate::Window::observed`] (states, then inputs), the number of steps that start in it and the
//! number of its first row as parameters, and its sums as the state at its end. Nothing is summed here: the crate `worker/sums` does it. Next file to read:
//! [`crate::equations`], for the functions of a model's rates.

use serde::{Deserialize, Serialize};

/// Which functions, at which steps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SumsDef {
    /// Parameters of the model in which its rates are linear. Without any the functions below are those of every equation.
    pub unknown: Vec<String>,
    /// All monomials of the states up to a degree.
    pub polynomial: Option<PolynomialDef>,
    /// Functions as texts.
    pub functions: Vec<String>,
    /// Parameters, states or texts whose functions are taken at the start of a step (Itô).
    pub left: Vec<String>,
    /// Sampling step, in the study's time unit.
    pub step: f64,
    /// Steps at which the sums are made, each twice the one before; 1 for the sampling step alone.
    pub levels: u32,
}

/// Monomials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PolynomialDef {
    /// Largest degree.
    pub degree: u32,
    /// Whether 1 is among them.
    pub constant: bool,
}

impl SumsDef {
    /// Rows after the last step of a block that its longest steps reach.
    pub fn n_ahead(&self) -> usize {
        (1_usize << (self.levels.max(1) - 1)) - 1
    }
}
