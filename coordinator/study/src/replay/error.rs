//! Why a run cannot be made again.

use crate::RunError;
use crate::store::StoreError;

/// Why a run cannot be made again.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The folder is of another command.
    #[error(
        "{0} is the folder of an explanation, whose runs are no sigma points: replay makes runs of `starlings run` again"
    )]
    Explanation(String),
    /// It was written by an earlier program.
    #[error(
        "{0} was written by an earlier version of this program, which kept no inputs of its runs: run the study again, and those runs can be replayed"
    )]
    NothingKept(String),
    /// It has no analysis.
    #[error("{0} holds no analysis yet: wait for the first one")]
    NoAnalysis(String),
    /// The study has no such particle.
    #[error("there is no particle {particle}: the particles of this run are 0 to {last}")]
    NoParticle {
        /// What was asked.
        particle: u32,
        /// Number of the last one.
        last: usize,
    },
    /// The particle was not run there.
    #[error(
        "particle {particle} was not run at {asked}: this run has passes 1 to {passes}, and analyses 0 to {last} in pass {pass}"
    )]
    NotRun {
        /// The particle.
        particle: u32,
        /// `pass 2, analysis 900`.
        asked: String,
        /// Number of passes.
        passes: usize,
        /// The pass that was asked for, or the last one.
        pass: usize,
        /// Its last analysis.
        last: usize,
    },
    /// The recordings are others.
    #[error(
        "the recordings changed since the run: {which}; the same inputs cannot be given: put the recordings back, or say with --study FILE where those of the run are"
    )]
    OtherRecordings {
        /// Names of the records.
        which: String,
    },
    /// The fleet or the estimator failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl ReplayError {
    /// Whether what was asked for is wrong.
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::Run(_) | Self::Store(_))
    }

    /// Whether a signal ended it.
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Run(error) if error.is_cancelled())
    }
}

impl From<starlings_fleet::FleetError> for ReplayError {
    fn from(error: starlings_fleet::FleetError) -> Self {
        Self::Run(error.into())
    }
}
