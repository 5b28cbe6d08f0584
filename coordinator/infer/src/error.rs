//! Why an inference ends without a result.
//!
//! Next file to read: [`super::run`].

use std::path::PathBuf;

use starlings_estimators::inference::InferenceError;
use starlings_fleet::FleetError;
use starlings_models::Failure;
use starlings_study::forecast::StudyForecastError;
use starlings_sums::SumsError;

/// Why there is no inference.
#[derive(Debug, thiserror::Error)]
pub enum InferError {
    /// The fleet failed as a whole.
    #[error(transparent)]
    Fleet(#[from] FleetError),
    /// What is asked for does not fit together.
    #[error(transparent)]
    Question(#[from] SumsError),
    /// The estimate cannot be made of these recordings.
    #[error("{error}{}", remedy(error))]
    Estimate {
        /// Why.
        #[from]
        error: InferenceError,
    },
    /// Errors of the measurement are far larger than what states move by in a step.
    #[error(
        "errors of the measurement hide how these states move in a step: {says}; no fit holds the recording as it was measured (give \
         `measurement_noise = <sd>` in [infer], which smooths, or average rows to fewer and longer steps; where the sensor is better than that, \
         steps are so long that neighbouring rows know nothing of one another: record in shorter ones)"
    )]
    Hidden {
        /// The states with the figures.
        says: String,
    },
    /// No path follows the recording under the errors of the measurement that the study gives.
    #[error(
        "no path of these states follows the recording under errors of the measurement of standard deviation {sd}, measurement_noise: {says} \
         ({help})"
    )]
    Lost {
        /// What the study gives.
        sd: f64,
        /// What the recording shows.
        says: String,
        /// What to do.
        help: &'static str,
    },
    /// There is no estimate, and values stand apart which may be why.
    #[error("{error}\n  {strays}")]
    Strays {
        /// Why there is none.
        error: Box<InferError>,
        /// What is said of the values.
        strays: String,
    },
    /// A recording is not what it should be.
    #[error("{}{}: {message} ({help})", file.display(), line.map(|line| format!(":{line}")).unwrap_or_default())]
    Recording {
        /// Its file.
        file: PathBuf,
        /// Line, from 1.
        line: Option<u64>,
        /// What was found.
        message: String,
        /// What to do.
        help: String,
    },
    /// A row of a record, by their numbers, is not what it should be; it is told as [`InferError::Recording`].
    #[error("{error}")]
    Row {
        /// Number of the record.
        record: usize,
        /// What is wrong with which row.
        error: InferenceError,
    },
    /// Workers cannot read a recording by themselves; it is read here then.
    #[error("a recording is no plain text of rows")]
    Unread,
    /// A block of a recording has no sums.
    #[error("record `{record}`: {failure}")]
    Block {
        /// The record.
        record: String,
        /// Why.
        failure: Failure,
    },
    /// The reduced model and the coefficients do not fit together.
    #[error("[infer.reduced]: {0}")]
    Reduced(String),
    /// A setting that these recordings do not allow.
    #[error("{0}")]
    Setting(String),
    /// A state that was written for another study, or is damaged.
    #[error("the state file {} cannot be continued: {message} (remove it to begin anew)", file.display())]
    State {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// There is no forecast.
    #[error(transparent)]
    Forecast(#[from] StudyForecastError),
    /// Something cannot be written or read.
    #[error("{what}: {error}")]
    File {
        /// What was done, with the file.
        what: String,
        /// Why it failed.
        error: std::io::Error,
    },
}

impl InferError {
    /// Whether somebody cancelled the work, rather than that it failed.
    pub fn is_cancelled(&self) -> bool {
        match self {
            Self::Fleet(error) => matches!(error, FleetError::Cancelled),
            Self::Forecast(StudyForecastError::Run(error)) => error.is_cancelled(),
            _ => false,
        }
    }

    /// Whether the input is wrong, rather than the run.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Fleet(_) | Self::File { .. } => false,
            Self::Forecast(error) => error.is_input(),
            _ => true,
        }
    }
}

/// What to do about an estimate that cannot be made.
fn remedy(error: &InferenceError) -> &'static str {
    match error {
        InferenceError::Collinear { .. } => {
            " (leave one of them out, give one a prior, or record where they differ)"
        }
        InferenceError::TooFew { .. } => " (record longer, ask for fewer coefficients, or give them priors)",
        InferenceError::NotSettled { .. } => {
            " (give `[[parameters]]` priors, ask for fewer terms, record in shorter steps, or use rule = \"ito\")"
        }
        InferenceError::DiffusionNotDefinite { .. } => {
            " (make the equation's state an input, use diffusion = \"diagonal\" where equations share their noise, look for a column that \
             stands twice or never moves, or give `measurement_noise = <sd>` where all that is seen of it are errors of the measurement)"
        }
        InferenceError::NothingObserved => {
            " (no function of theirs was ever different from zero in these recordings)"
        }
        _ => "",
    }
}
