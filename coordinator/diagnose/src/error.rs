//! Why a diagnosis ends without a result.
//!
//! Next file to read: [`super::run`].

use starlings_fleet::FleetError;
use starlings_study::{RunError, Study};

/// Why there is no diagnosis.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// The fleet failed as a whole, or a run has no usable answer.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The model without a fault cannot be run.
    #[error(
        "the model without a fault fails at its prior median: {0} (mend the constants or the priors of the study)"
    )]
    Healthy(String),
    /// No scenario can be run.
    #[error("no scenario of the library can be run; `{name}` fails: {reason}")]
    NoScenario {
        /// The first scenario.
        name: String,
        /// Why its run fails.
        reason: String,
    },
    /// Nothing is left to compare with.
    #[error("no measured value of the training spans is left to compare with")]
    NoValues,
}

impl From<FleetError> for DiagnoseError {
    fn from(error: FleetError) -> Self {
        Self::Run(error.into())
    }
}

impl DiagnoseError {
    /// Whether somebody cancelled the work, rather than that it failed.
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Run(error) if error.is_cancelled())
    }

    /// Whether the input is wrong, rather than the run.
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::Run(_))
    }
}

/// The error of a run whose answer has another length than was asked for.
pub(crate) fn no_answer(
    study: &Study,
    particle: usize,
    record: usize,
    n: usize,
    wanted: usize,
) -> DiagnoseError {
    let record = study.records[record].name.clone();
    let reason = format!("{n} predicted values for {wanted}");
    RunError::NoAnswer { particle, record, values: String::new(), reason }.into()
}
