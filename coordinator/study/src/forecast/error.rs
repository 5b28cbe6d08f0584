//! Why there is no forecast.

use starlings_estimators::forecast::ForecastError;
use starlings_models::SetupError;

use crate::RunError;
use crate::store::StoreError;

/// Why there is no forecast.
#[derive(Debug, thiserror::Error)]
pub enum StudyForecastError {
    /// What was asked does not fit the run or the study.
    #[error("{0}")]
    Request(String),
    /// A name or value does not fit the model.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The store of the run cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The fleet failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The model failed for every member.
    #[error("none of {members} members has a prediction: {reason}")]
    NoMember {
        /// Members that were run.
        members: usize,
        /// Why the first one failed.
        reason: String,
    },
    /// The ensemble gives no figures.
    #[error(transparent)]
    Ensemble(#[from] ForecastError),
}

impl StudyForecastError {
    /// Whether the input is wrong, rather than the run.
    pub fn is_input(&self) -> bool {
        matches!(self, Self::Request(_) | Self::Setup(_) | Self::Store(_))
    }
}
