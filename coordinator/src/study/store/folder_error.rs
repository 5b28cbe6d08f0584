//! Why a run folder refuses, with the remedy.

use std::io;
use std::path::PathBuf;

use super::StoreError;

/// Why a run folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It already holds a run.
    #[error("{0} already holds a run: continue it with --resume, or choose another folder with --out")]
    Occupied(PathBuf),
    /// It holds a file that a run would overwrite.
    #[error("{0} exists already, and a run would overwrite it: choose another folder with --out")]
    InTheWay(PathBuf),
    /// Another process runs in it.
    #[error("another process is running in {0}: wait for its end, or stop it")]
    Locked(PathBuf),
    /// Its run never got as far as its first step.
    #[error("{0} holds no run that could be continued: remove the folder and start again without --resume")]
    NeverStarted(PathBuf),
    /// It cannot be made or written.
    #[error("cannot write to {path}: {source}")]
    Unwritable {
        /// The folder or file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A resumed run was started from another study.
    #[error(
        "{folder} was started from another study: {what} changed since; start a new run instead of --resume"
    )]
    OtherStudy {
        /// The folder.
        folder: PathBuf,
        /// `the study file`, `the recordings` or `the solver or one of its files`.
        what: &'static str,
    },
    /// It belongs to another command.
    #[error("{folder} holds {holds} of `{command}`: continue it there, or choose another folder with --out")]
    OtherPurpose {
        /// The folder.
        folder: PathBuf,
        /// `a run` or `an explanation`.
        holds: &'static str,
        /// The command that it belongs to.
        command: &'static str,
    },
    /// The database failed.
    #[error(transparent)]
    Store(#[from] StoreError),
}
