//! Why a run ends without a result. Next file to read: [`crate::run`].

use starlings_estimators::EstimatorError;
use starlings_fleet::{FleetError, StateError};
use starlings_models::Failure;

use crate::Study;
use crate::store::StoreError;
use crate::trial::named;

/// Why a run ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The fleet failed as a whole.
    #[error(transparent)]
    Fleet(#[from] FleetError),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A large state of a particle cannot be kept or read.
    #[error(transparent)]
    State(#[from] StateError),
    /// The estimator could not go on.
    #[error(transparent)]
    Estimator(#[from] EstimatorError),
    /// A sigma point failed at every distance from the mean and the others do not span the parameters.
    #[error(
        "sigma point {particle} of pass {pass}, step {step} failed even next to the mean ({values}): {cause}; {source}"
    )]
    SigmaPointLost {
        /// Index of the sigma point.
        particle: usize,
        /// Pass, from 1.
        pass: usize,
        /// Step within the pass.
        step: usize,
        /// Its parameters in physical units.
        values: String,
        /// Why its run failed.
        cause: String,
        /// What the estimator advises.
        source: EstimatorError,
    },
    /// A run has no usable answer, and the model did not fail.
    #[error(
        "the run of particle {particle} over record `{record}`{} has no usable answer: {reason}",
        in_brackets(values)
    )]
    NoAnswer {
        /// Index of the sigma point.
        particle: usize,
        /// Record name.
        record: String,
        /// Its parameters in physical units; empty where they are not known.
        values: String,
        /// What is wrong with the answer.
        reason: String,
    },
    /// A figure of the result is no finite number.
    #[error(
        "the {0} of the result is not a finite number: the priors or the noise are out of all proportion to the data"
    )]
    NotFinite(String),
    /// The model fails at the estimate itself.
    #[error("the model fails with the estimated parameters on record `{record}`: {source}")]
    FinalRun {
        /// Record name.
        record: String,
        /// Why.
        source: Failure,
    },
}

impl RunError {
    /// The same with names and values where a job of the fleet is meant; `theta` gives the parameters of a job.
    pub(crate) fn naming(self, study: &Study, theta: impl Fn(usize) -> Option<Vec<f64>>) -> Self {
        match self {
            Self::Fleet(FleetError::NoAnswer { job, particle, record, reason }) => {
                let record = study.records[record as usize].name.clone();
                let values = theta(job).map_or_else(String::new, |theta| named(study, &theta));
                Self::NoAnswer { particle: particle as usize, record, values, reason }
            }
            other => other,
        }
    }

    /// Whether a piece of a particle's state is not where it belongs.
    pub fn misses_a_piece(&self) -> bool {
        match self {
            Self::State(error) | Self::Store(StoreError::State(error)) => error.is_missing(),
            _ => false,
        }
    }

    /// Whether the work was cancelled; false when it failed.
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Fleet(FleetError::Cancelled))
    }
}

fn in_brackets(values: &str) -> String {
    if values.is_empty() { String::new() } else { format!(" ({values})") }
}
