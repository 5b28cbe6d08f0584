//! Files of other programs as studies: networks of svZeroDSolver (JSON) and openBF (YAML).
//!
//! A file is read strictly: what is not understood is named and nothing is written. Recordings are not in these files, so the
//! study is given the model's own predictions in their place. Next files to read: [`svzerod`] and [`openbf`], which make a
//! [`plan::Plan`], then [`write`], which makes the study of it.

#[cfg(fuzzing)]
pub mod fuzzing;
mod openbf;
mod plan;
mod svzerod;
mod text;
mod write;

use std::path::Path;

use starlings_study::SolverHost;

use crate::{Draft, DraftError};

/// Bytes of a file at most; the largest networks in use have a few hundred thousand.
const MOST_BYTES: u64 = 64 << 20;

/// Writes the study of a file of another program into a new folder.
///
/// # Errors
/// When the file cannot be read or holds what the model lacks, the folder is there already, or the model does not run.
pub fn import(file: &Path, out: &Path, host: &SolverHost) -> Result<Draft, DraftError> {
    let refuse = |message: String| DraftError::File { file: file.to_owned(), message };
    let size = std::fs::metadata(file).map_err(|error| refuse(format!("cannot be read: {error}")))?.len();
    if size > MOST_BYTES {
        return Err(refuse(format!("{size} bytes are more than a network has ({MOST_BYTES})")));
    }
    let text = std::fs::read_to_string(file).map_err(|error| refuse(format!("cannot be read: {error}")))?;
    let extension = file.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let stem = file.file_stem().and_then(|s| s.to_str()).unwrap_or("study");
    let plan = match extension.as_str() {
        "json" => svzerod::plan(stem, &text),
        "yaml" | "yml" => openbf::plan(file, &text),
        _ => {
            let known = "a JSON of svZeroDSolver (.json) or a YAML of openBF (.yaml, .yml)";
            Err(format!("the name does not say what it is: give {known}"))
        }
    };
    write::write(file, &plan.map_err(refuse)?, out, host)
}
