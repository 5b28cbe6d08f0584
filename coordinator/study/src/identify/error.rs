//! Why the sensitivities of a study could not be computed.
//!
//! Next file to read: [`super::ensemble`].

use starlings_estimators::EstimatorError;
use starlings_models::Failure;

use crate::store::StoreError;
use crate::{FolderError, RunError};

/// Why the sensitivities could not be computed.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// The fleet failed, or a run has no usable answer.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The figures cannot be computed.
    #[error(transparent)]
    Estimator(#[from] EstimatorError),
    /// The model fails next to the point of the analysis.
    #[error(
        "the model fails on record `{record}` at {place}: {source}; bound the parameter with a logit transform, move its \
         prior, or set a smaller [estimator] spread (kind = \"batch\")"
    )]
    Particle {
        /// Record name.
        record: String,
        /// Which parameter was moved, which way and to what value.
        place: String,
        /// Why it failed.
        source: Failure,
    },
    /// A prediction is no finite number.
    #[error(
        "`{output}` of record `{record}` is {value} at time {time}, {place}: check constants, priors and inputs"
    )]
    Prediction {
        /// Output name.
        output: String,
        /// Record name.
        record: String,
        /// Time of the prediction.
        time: f64,
        /// The prediction.
        value: f64,
        /// Which parameter was moved, which way and to what value.
        place: String,
    },
    /// The folder given as the point of the analysis cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// Its store cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The run in it is no point of this study.
    #[error("{0}")]
    Point(String),
}

impl IdentifyError {
    /// Whether the input is wrong, rather than the run.
    pub fn is_input(&self) -> bool {
        matches!(self, Self::Folder(_) | Self::Store(_) | Self::Point(_))
    }
}
