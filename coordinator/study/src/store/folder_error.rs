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
    #[error(
        "another process is running in {folder}{by}: wait for its end, stop it, or choose another folder with --out"
    )]
    Locked {
        /// The folder.
        folder: PathBuf,
        /// ` (process 17 on host)`; empty where that is not known.
        by: String,
    },
    /// Its file system keeps no locks, and another process may run in it.
    #[error(
        "another process may be running in this folder: its file system keeps no locks, and {} names process {pid} on {host}: wait for \
         its end or stop it; if it is gone, remove {}",
        path.display(),
        path.display()
    )]
    MaybeLocked {
        /// The file of the lock.
        path: PathBuf,
        /// The process that it names.
        pid: u32,
        /// Where that ran.
        host: String,
    },
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
        "{folder} was started from another study: {what} changed since{which}; start a new run instead of --resume"
    )]
    OtherStudy {
        /// The folder.
        folder: PathBuf,
        /// `the study file`, `the recordings` or `the solver or one of its files`.
        what: &'static str,
        /// The keys with both values, or the records; empty where that is not known.
        which: String,
    },
    /// It was begun by another version of this program.
    #[error(
        "{folder} was begun by starlings {}, this is {this}: another version may give other estimates and intervals; \
         continue with the version that began it, or start a new run instead of --resume",
        if version.is_empty() { "of an earlier state" } else { version }
    )]
    OtherVersion {
        /// The folder.
        folder: PathBuf,
        /// The version that began it; empty where it did not say.
        version: String,
        /// This version.
        this: String,
    },
    /// It was begun by another build of the same version.
    #[error(
        "{folder} was begun by another build of starlings {version} ({build}; this is {this}): estimates, intervals and \
         likelihoods may differ in their last digits, or by more where a model changed between the two; continue with the \
         program that began it, start a new run, or go on all the same with --resume --other-build: {kept}"
    )]
    OtherBuild {
        /// The folder.
        folder: PathBuf,
        /// The version of both.
        version: String,
        /// The build that began it.
        build: String,
        /// This build.
        this: String,
        /// What becomes of what is stored.
        kept: &'static str,
    },
    /// It was begun with another solver.
    #[error(
        "{folder} was begun with another solver: {what}; every number may differ. Put back what it was, start a new run, or \
         go on all the same with --resume --other-build: {kept}"
    )]
    OtherSolver {
        /// The folder.
        folder: PathBuf,
        /// What differs.
        what: String,
        /// What becomes of what is stored.
        kept: &'static str,
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

impl FolderError {
    /// Whether the input is wrong, rather than that the disk failed.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Unwritable { source, .. } => source.kind() != io::ErrorKind::StorageFull,
            Self::Store(error) => !error.is_of_disk(),
            _ => true,
        }
    }
}
