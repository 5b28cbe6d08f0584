//! Why an explanation ends without a result.
//!
//! Next file to read: [`super::rows`].

use starlings_estimators::EstimatorError;
use starlings_fleet::FleetError;
use starlings_models::SetupError;
use starlings_study::store::StoreError;
use starlings_study::{RunError, Study};

/// Why there is no explanation.
#[derive(Debug, thiserror::Error)]
pub enum ExplainError {
    /// The fleet failed as a whole.
    #[error(transparent)]
    Fleet(#[from] FleetError),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A run has no usable result, and the cause is not the model.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A step of the estimator failed.
    #[error(transparent)]
    Estimator(#[from] EstimatorError),
    /// The model with an effect does not build although it was checked.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// There is nothing to try.
    #[error("{0}")]
    NothingToTry(String),
    /// The fit of the model as it is did not converge.
    #[error(
        "the fit of the model as it is has not converged after {iterations} iterations: it stands at {stand}; improve priors \
         or initial values, or go on from there with --force"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Where it stands, in words.
        stand: String,
    },
    /// The model as it is cannot be run at all.
    #[error("the model as it is fails at its prior median: {0}")]
    Baseline(String),
    /// The budget does not suffice for the fit of the model as it is.
    #[error("the budget of {budget} runs ended during the {stage}: {needed} more would be needed")]
    Budget {
        /// The budget.
        budget: u64,
        /// The stage.
        stage: &'static str,
        /// Runs that were asked for.
        needed: u64,
    },
    /// A name that is not among the candidates.
    #[error("{0}")]
    Name(String),
    /// A noise whose size does not go with the recorded values.
    #[error("{0}")]
    Noise(String),
}

impl ExplainError {
    /// Whether somebody cancelled the work, rather than that it failed.
    pub fn is_cancelled(&self) -> bool {
        match self {
            Self::Fleet(error) => matches!(error, FleetError::Cancelled),
            Self::Run(error) => error.is_cancelled(),
            _ => false,
        }
    }

    /// Whether the input is wrong, rather than the run.
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::NothingToTry(_)
                | Self::NotConverged { .. }
                | Self::Name(_)
                | Self::Noise(_)
                | Self::Baseline(_)
                | Self::Budget { .. }
        )
    }
}

/// The error of a failure of the fleet, with the name of the record where it concerns one run.
pub(crate) fn fleet_failure(study: &Study, error: FleetError) -> ExplainError {
    match error {
        FleetError::NoAnswer { particle, record, reason, .. } => {
            no_answer(study, particle, record as usize, reason)
        }
        other => other.into(),
    }
}

/// The error of a run without a usable result.
pub(crate) fn no_answer(study: &Study, particle: u32, record: usize, reason: String) -> ExplainError {
    let record = study.records[record].name.clone();
    RunError::NoAnswer { particle: particle as usize, record, values: String::new(), reason }.into()
}
