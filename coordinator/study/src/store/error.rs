//! Why a store refuses, with the remedy.

use std::path::{Path, PathBuf};

use starlings_fleet::StateError;

/// Why the store cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database refused; the text names the file and the remedy.
    #[error("cannot use {path}: {source}{}", remedy(path, source))]
    Database {
        /// The database file.
        path: PathBuf,
        /// What SQLite said.
        source: rusqlite::Error,
    },
    /// The folder or its database is missing or of another version.
    #[error("{0}")]
    Unusable(String),
    /// A result holds a figure that is no finite number, and so is not stored.
    #[error(
        "a figure of the {what} is no finite number ({reason}): the recorded values, their noise and the priors differ by too \
         many powers of ten; give quantities in units in which they are between 1e-6 and 1e6"
    )]
    NotFinite {
        /// Which result.
        what: &'static str,
        /// Where in it.
        reason: String,
    },
    /// A state of a particle cannot be written or read.
    #[error(transparent)]
    State(#[from] StateError),
    /// A stored value cannot be read back.
    #[error("{path} holds a damaged {what}: {reason}")]
    Damaged {
        /// The database file.
        path: PathBuf,
        /// Which value.
        what: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

impl StoreError {
    /// Whether the disk failed or has no room.
    pub(crate) fn is_of_disk(&self) -> bool {
        let Self::Database { source, .. } = self else { return false };
        let code = source.sqlite_error_code();
        matches!(code, Some(rusqlite::ErrorCode::DiskFull | rusqlite::ErrorCode::SystemIoFailure))
    }
}

fn remedy(path: &Path, source: &rusqlite::Error) -> &'static str {
    match source.sqlite_error_code() {
        // What cannot be made whole is removed.
        Some(rusqlite::ErrorCode::DiskFull | rusqlite::ErrorCode::SystemIoFailure)
            if path.try_exists().is_ok_and(|is_there| !is_there) =>
        {
            "; the disk failed or is full, and nothing was begun: see that it has space and start again"
        }
        Some(rusqlite::ErrorCode::DiskFull) => {
            "; the disk is full: free some space and continue with --resume, all but its last moment is kept"
        }
        Some(rusqlite::ErrorCode::DatabaseBusy | rusqlite::ErrorCode::DatabaseLocked) => {
            "; another process is using this run folder"
        }
        Some(rusqlite::ErrorCode::SystemIoFailure) => {
            "; the disk failed or is full: see that it has space and continue with --resume, all but its last moment is kept"
        }
        Some(rusqlite::ErrorCode::NotADatabase) => ": give the folder of a run",
        Some(rusqlite::ErrorCode::ReadOnly | rusqlite::ErrorCode::CannotOpen) => {
            "; check that the folder exists and may be written"
        }
        _ => "",
    }
}
