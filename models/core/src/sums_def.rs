//! What the jobs of a dynamical inference sum over their rows: functions of the model's states and inputs, as plain data.
//!
//! Such a job has a row per time in [`crate::Window::observed`] (states, then inputs), the number of steps that start in it and the
//! number of its first row as parameters, and its sums as the state at its end. Where [`SumsDef::files`] names the recordings, a job names
//! bytes of one instead of rows. Nothing is summed here: the crate `worker/sums` does it. Next file to read:
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
    /// Functions, as texts, of which each equation may lack a term.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub candidates: Vec<String>,
    /// Sampling step, in the study's time unit.
    pub step: f64,
    /// Steps at which the sums are made, each twice the one before; 1 for the sampling step alone.
    pub levels: u32,
    /// Pairs of neighbouring steps that a block gives beside its sums, at most; as many as it can where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pairs: Option<usize>,
    /// The recordings as files that workers read by themselves, by the number of the record; none where rows travel.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<SumsFile>,
}

/// A recording that workers read: a text of numbers separated by commas, a row per line.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SumsFile {
    /// The file, with its absolute path.
    pub path: String,
    /// Its length in bytes.
    pub length: u64,
    /// When it was last changed, nanoseconds since 1970. A file of another length or time is not read.
    pub modified: u64,
    /// Cells of a row.
    pub n_cell: usize,
    /// Positions in a row of the time, the states and the inputs.
    pub cells: Vec<usize>,
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
