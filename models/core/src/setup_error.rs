//! Why a setup does not make a model.
//!
//! Next file to read: [`crate::setup`].

/// Why a setup does not make a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// A name that no model, quantity, observer or effect has.
    #[error("no {what} named `{name}`{}", crate::meant(nearest.as_ref()))]
    Unknown {
        /// What was looked for, such as `model`, `parameter` or `rate term`.
        what: &'static str,
        /// The name given.
        name: String,
        /// The nearest valid name, if one is close.
        nearest: Option<String>,
    },
    /// A model parameter that neither the constants nor the parameters give.
    #[error(
        "parameter `{name}` of model `{model}` has no value: add it to the model's constants or to the parameters"
    )]
    Missing {
        /// The model's kind.
        model: String,
        /// The parameter.
        name: String,
    },
    /// A name given twice.
    #[error("`{0}` is given twice")]
    Twice(String),
    /// An expression that does not parse or uses what it may not.
    #[error("in `{expression}` at column {column}: {message}")]
    Expression {
        /// Where the expression stands, such as `rate of v` or `effect overflow`.
        place: String,
        /// The expression's text.
        expression: String,
        /// Character position of the fault, from 1.
        column: usize,
        /// What is wrong and what was expected.
        message: String,
    },
    /// A fault in the layout of a model.
    #[error("in the model's layout{}: {message}", if path.is_empty() || path == "." { String::new() } else { format!(" at `{path}`") })]
    Layout {
        /// The place, such as `regions[2].to`; empty for the layout as a whole.
        path: String,
        /// What is wrong and what was expected.
        message: String,
    },
    /// Anything else that does not fit.
    #[error("{0}")]
    Invalid(String),
}
