//! The files of a finished run: `posterior.csv`, `summary.json`, `report.html` and, where it predicted anything, `predicted.csv`, all
//! made from its store.

use std::io;
use std::path::PathBuf;

use starlings_study::RunFolder;
use starlings_study::predicted;
use starlings_study::store::StoreError;
use starlings_study::store::folder::write;

use super::{ReportError, reader, render};

/// Why the files could not be written.
#[derive(Debug, thiserror::Error)]
pub enum FilesError {
    /// The store failed, or the run is not finished.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The explanation in this folder is not finished.
    #[error(
        "the explanation in {path} is not finished: continue it with `starlings explain STUDY --out {path} --resume`",
        path = .0.display()
    )]
    Unfinished(PathBuf),
    /// The page could not be made.
    #[error(transparent)]
    Page(#[from] ReportError),
    /// A file of a result that no store holds could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Result {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file could not be written.
    #[error(
        "cannot write {path}: {source}; the result is safe in run.db, `starlings report` writes the files again"
    )]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// Writes the files into the run folder.
///
/// # Errors
/// When the run is not finished, the store is damaged, or a file cannot be written.
pub fn write_files(folder: &RunFolder) -> Result<(), FilesError> {
    let Some(summary) = folder.summary()? else {
        let text = format!("the run in {} is not finished: continue it with --resume", folder.path.display());
        return Err(StoreError::Unusable(text).into());
    };
    write_page(folder)?;
    let posterior = folder.store.meta("posterior")?.unwrap_or_default();
    let summary =
        serde_json::to_string_pretty(&summary).map_err(|e| folder.store.damaged("summary", e))? + "\n";
    for (name, text) in [("posterior.csv", posterior), ("summary.json", summary)] {
        place(folder, name, &text)?;
    }
    let courses = predicted::read(&folder.store)?;
    if !courses.is_empty() {
        let text = predicted::to_csv(&courses).map_err(|e| folder.store.damaged("predictions", e))?;
        place(folder, "predicted.csv", &text)?;
    }
    Ok(())
}

/// Writes `report.html`, of a run that is not finished with what there is.
///
/// # Errors
/// When the store is damaged or the file cannot be written.
pub fn write_page(folder: &RunFolder) -> Result<(), FilesError> {
    let page = render(&reader::report_data(&folder.store)?)?;
    place(folder, "report.html", &page)
}

pub(super) fn place(folder: &RunFolder, name: &str, text: &str) -> Result<(), FilesError> {
    let path = folder.path.join(name);
    write(&path, text).map_err(|source| FilesError::File { path, source })
}
