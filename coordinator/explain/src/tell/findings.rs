//! The findings of an explanation, saved in the run's database, from which the report and the files are made.
//!
//! Next file to read: `explain.rs` of `starlings-report`.

use serde::Serialize;
use serde::de::DeserializeOwned;
use starlings_study::RunFolder;
use starlings_study::store::{EXPLANATION, Store, StoreError};

use super::figures::Figures;
use super::result::Explanation;

/// Names of the parts in the store.
const FIGURES: &str = "figures";
const EXPLAINED: &str = "explained";

/// An explanation with what its report draws and the study that it proposes.
#[derive(Clone, Debug)]
pub struct Findings {
    /// The explanation.
    pub explanation: Explanation,
    /// The data of the report's figures.
    pub figures: Figures,
    /// Text of the study with the effects in it, when something was added.
    pub explained_study: Option<String>,
}

/// Saves the findings, by which the explanation is finished.
///
/// # Errors
/// When the store fails, or a figure is no finite number and so could not be read again.
pub fn save_findings(folder: &RunFolder, findings: &Findings) -> Result<(), StoreError> {
    let store = &folder.store;
    let explanation = readable(EXPLANATION, &findings.explanation)?;
    let figures = readable(FIGURES, &findings.figures)?;
    store.set_meta(FIGURES, &figures)?;
    store.set_meta(EXPLAINED, findings.explained_study.as_deref().unwrap_or_default())?;
    // This is written last, because the explanation counts as finished as soon as it is there.
    store.set_meta(EXPLANATION, &explanation)?;
    // The remembered runs are most of the file, and a finished explanation needs them no more. If they cannot be removed, it is
    // finished all the same.
    let _ = store.forget_runs();
    // A reader of the database may keep its log open; the explanation is finished all the same.
    let _ = store.close_log();
    Ok(())
}

/// The findings of a finished explanation.
///
/// # Errors
/// When the store fails or its content is damaged.
pub fn load_findings(store: &Store) -> Result<Option<Findings>, StoreError> {
    let Some(explanation) = parsed::<Explanation>(store, EXPLANATION)? else { return Ok(None) };
    let figures = parsed::<Figures>(store, FIGURES)?.unwrap_or_default();
    let explained_study = store.meta(EXPLAINED)?.filter(|text| !text.is_empty());
    Ok(Some(Findings { explanation, figures, explained_study }))
}

fn parsed<T: DeserializeOwned>(store: &Store, name: &'static str) -> Result<Option<T>, StoreError> {
    let text = store.meta(name)?;
    text.map(|text| serde_json::from_str(&text).map_err(|e| store.damaged(name, e))).transpose()
}

/// The value as JSON that can be read again. JSON writes a NaN as `null`, which is not read as a number; this is an error here.
fn readable<T: Serialize + DeserializeOwned>(name: &'static str, value: &T) -> Result<String, StoreError> {
    let text = serde_json::to_string(value);
    let read = text.and_then(|text| serde_json::from_str::<T>(&text).map(|_| text));
    read.map_err(|e| StoreError::NotFinite { what: name, reason: e.to_string() })
}
