//! The text of a study with the effects in it that explain its misfit.
//!
//! The author's text keeps its layout and comments; each addition is written beside its like. Nothing is estimated here: the
//! priors are wide around the estimates, so that a run of the new study makes estimates of its own. Next files to read:
//! [`effect`] for what is added, [`mod@remove`] for what is taken out, [`place`] for files that must still be found.

pub(crate) mod drift;
mod effect;
mod place;
mod prior;
mod remove;

use std::path::Path;

use starlings_models::EffectDef;
use starlings_study::{Study, StudyError};
use toml_edit::{Array, DocumentMut, Item, TableLike, Value};

use super::result::Coefficient;

/// An effect to write into a study, with the values of its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchEffect {
    /// The effect, written out.
    pub def: EffectDef,
    /// Its parameters. One without a positive sd was not estimated and becomes a constant.
    pub values: Vec<Coefficient>,
}

/// Why the study with the effects cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum PatchError {
    /// The text of the study cannot be parsed or changed.
    #[error("the study's text cannot be changed: {0}")]
    Text(String),
    /// The model has no rate term of the name of one that is to be replaced.
    #[error("no rate of the study's model has a term named `{0}`")]
    NoTerm(String),
    /// The new text is refused as a study.
    #[error("the study with the effects in it is refused: {0}")]
    Refused(#[from] StudyError),
}

/// The text of the study with `effects` in its model and without the rate terms `removed`, to stand in the folder `to`:
/// files that the study names are named from there. It was loaded once, so it runs as it is.
///
/// # Errors
/// When the text cannot be changed, a term is not found, or the new study is refused.
pub fn explained_study(
    study: &Study,
    effects: &[PatchEffect],
    removed: &[String],
    to: &Path,
) -> Result<String, PatchError> {
    let mut document: DocumentMut =
        study.text.parse().map_err(|e: toml_edit::TomlError| PatchError::Text(e.to_string()))?;
    if let Some(table) = document.get_mut("study").and_then(Item::as_table_like_mut) {
        set_text(table, "name", &format!("{}-explained", study.name));
    }
    place::relocate(&mut document, &study.file, to);
    for term in removed {
        remove::term(&mut document, term)?;
    }
    for found in effects {
        effect::add(&mut document, study, found)?;
    }
    if !removed.is_empty() {
        remove::orphans(&mut document)?;
    }
    let text = document.to_string();
    // The description of the solver is known; it is not asked for a second time.
    let solver_host = match study.setup.model.description() {
        Some(description) => study.solver_host.knowing(description),
        None => study.solver_host.clone(),
    };
    Study::from_text_with(&to.join("explained.toml"), &text, &solver_host)?;
    Ok(text)
}

/// Calls `each` with every table of a list, written as `[[key]]` or as `key = [ { ... } ]`.
fn each_table(parent: &mut dyn TableLike, key: &str, each: &mut dyn FnMut(&mut dyn TableLike)) {
    match parent.get_mut(key) {
        Some(Item::ArrayOfTables(list)) => list.iter_mut().for_each(|table| each(table)),
        Some(Item::Value(Value::Array(list))) => {
            list.iter_mut().filter_map(Value::as_inline_table_mut).for_each(|table| each(table));
        }
        _ => {}
    }
}

/// The text behind a key; empty without one.
fn text(table: &dyn TableLike, key: &str) -> String {
    table.get(key).and_then(Item::as_str).unwrap_or_default().to_owned()
}

/// Replaces the text behind a key, with the spaces and comments around it.
fn set_text(table: &mut dyn TableLike, key: &str, new: &str) {
    if let Some(value) = table.get_mut(key).and_then(Item::as_value_mut) {
        let decor = value.decor().clone();
        *value = Value::from(new);
        *value.decor_mut() = decor;
    }
}

/// The list behind a key as a list of values.
fn array<'a>(table: &'a mut dyn TableLike, key: &str) -> Option<&'a mut Array> {
    table.get_mut(key).and_then(Item::as_array_mut)
}
