//! Models written in a study as equations: an expression language, and a [`crate::Model`] made of its expressions.
//!
//! It does not read study files: [`EquationsDef`] is plain data that a study parser fills. It does not integrate:
//! [`crate::integrate`] does. Next file to read: [`expression`], then [`def`], then [`model`].

/// The kind of a model written in the study itself.
pub const KIND: &str = "equations";

/// What the kind says of itself.
pub const SAYS: &str = "States, rates and outputs as the study writes them.";

mod affine;
mod at;
mod build;
mod calculus;
pub(crate) mod check;
mod compile;
mod def;
pub(crate) mod dimension;
mod drift;
mod dual;
mod expression;
mod expression_error;
mod inline;
mod linear;
mod model;
mod node;
mod noise;
mod parse;
mod parsed;
mod program;
mod reach;
mod smooth;
mod tape;
mod values;

pub use at::{At, Direction, Slot};
pub use check::has_meaning;
pub use def::{EquationsDef, InputDef, Method, OutputDef, SolverDef, StateDef};
pub use drift::{Drift, DriftFunction, DriftPlace};
pub use expression::Expression;
pub use expression_error::ExpressionError;
pub use model::EquationsModel;
pub use program::Program;
pub(crate) use program::Programs;
