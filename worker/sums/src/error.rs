//! Why the sums of a setup cannot be made.
//!
//! Next file to read: [`super::question`].

use starlings_estimators::inference::InferenceError;
use starlings_models::SetupError;

/// Why the sums of a setup cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SumsError {
    /// The model does not build, or is not linear in what is unknown.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// Functions or coefficients do not fit together.
    #[error(transparent)]
    Inference(#[from] InferenceError),
    /// The setup asks for no sums, or not of equations.
    #[error("{0}")]
    Unasked(&'static str),
}
