//! First versions of studies, written from files that people have.
//!
//! A draft is a folder with a study that `starlings check` accepts, its data and notes of what the file did not say. Nothing is
//! estimated here. Next files to read: [`import`], which takes files of other programs, and [`mod@init`], which takes recordings and models.

mod files;
pub mod import;
pub mod init;
mod names;

use std::path::{Path, PathBuf};

use starlings_study::{StudyError, twin::TwinError};

/// A study that was written.
#[derive(Clone, Debug)]
pub struct Draft {
    /// The study file.
    pub study: PathBuf,
    /// One sentence each: what the file does not say or what was put in another form.
    pub notes: Vec<String>,
}

/// Why no study was written.
#[derive(Debug, thiserror::Error)]
pub enum DraftError {
    /// The file is not what it should be, or holds what no model here has.
    #[error("{}: {message}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What and where, with a remedy.
        message: String,
    },
    /// Something that was asked for does not fit, or was not said.
    #[error("{0}")]
    Wish(String),
    /// The study that was written does not run.
    #[error("nothing was written: {0}")]
    Trial(String),
    /// The folder is there already.
    #[error("{} is there already: give another folder with --out, or remove it", .0.display())]
    Taken(PathBuf),
    /// A file could not be written.
    #[error("cannot write {}: {error}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        error: std::io::Error,
    },
    /// The model that the file describes cannot be built.
    #[error("the model is refused: {0}")]
    Study(#[from] StudyError),
    /// The model that the file describes cannot be run.
    #[error("the model: {0}")]
    Run(#[from] TwinError),
}

impl DraftError {
    fn file(file: &Path, message: impl Into<String>) -> Self {
        Self::File { file: file.to_owned(), message: message.into() }
    }
}
