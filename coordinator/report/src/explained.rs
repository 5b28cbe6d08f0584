//! The files of a finished explanation: `explain.json`, `explained.toml` and `report.html`, all made from its store.
//!
//! Next file to read: [`super::explain`].

use starlings_explain::{Findings, load_findings};
use starlings_study::RunFolder;
use starlings_study::store::StoreError;
use starlings_study::store::folder::StudyInfo;

use super::explain::{StudyAbout, explain_page};
use super::files::{FilesError, place};

/// Writes the files into the run folder and gives back what they hold.
///
/// # Errors
/// When the explanation is not finished, the store is damaged, or a file cannot be written.
pub fn write_explanation(folder: &RunFolder) -> Result<Findings, FilesError> {
    let found = load_findings(&folder.store)?.ok_or_else(|| FilesError::Unfinished(folder.path.clone()))?;
    let page = explain_page(&found.explanation, &found.figures, &about(folder)?)?;
    place(folder, "report.html", &page)?;
    if let Some(text) = &found.explained_study {
        place(folder, "explained.toml", text)?;
    }
    let explanation = serde_json::to_string_pretty(&found.explanation)
        .map_err(|e| folder.store.damaged("explanation", e))?;
    place(folder, "explain.json", &(explanation + "\n"))?;
    Ok(found)
}

fn about(folder: &RunFolder) -> Result<StudyAbout, StoreError> {
    let text = folder.store.meta("info")?.unwrap_or_default();
    let info: StudyInfo = serde_json::from_str(&text).map_err(|e| folder.store.damaged("info", e))?;
    Ok(StudyAbout {
        says: info.says.unwrap_or_default(),
        command: info.command,
        started: info.started,
        version: info.version,
        states: info.states,
    })
}

/// Names of the model's states, as the folder's store keeps them.
///
/// # Errors
/// When the store is damaged.
pub fn state_names(folder: &RunFolder) -> Result<Vec<String>, StoreError> {
    Ok(about(folder)?.states)
}
