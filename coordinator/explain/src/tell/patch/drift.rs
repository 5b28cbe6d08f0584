//! The text of a study of stochastic equations with the terms that its drift lacks.
//!
//! A term enters the rate of its equation, its coefficient the parameters that are inferred; where the study infers functions in every
//! equation, the function joins them. Next file to read: [`super::place`].

use std::path::Path;

use starlings_study::Study;
use toml_edit::{Array, DocumentMut, Item, Value, value};

use super::{PatchError, array, each_table, place, set_text, text};

/// A term that a drift lacks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DriftTerm {
    /// The equation, by the name of its state.
    pub equation: String,
    /// The function that its coefficient multiplies.
    pub function: String,
}

/// The text of the study with `terms` in its drift, to stand in the folder `to` as `explained.toml`, and the name of the coefficient of each.
///
/// # Errors
/// When the text cannot be changed, an equation is not found, or the new study is refused.
pub fn explained_drift(
    study: &Study,
    terms: &[DriftTerm],
    to: &Path,
) -> Result<(String, Vec<String>), PatchError> {
    let mut document: DocumentMut =
        study.text.parse().map_err(|e: toml_edit::TomlError| PatchError::Text(e.to_string()))?;
    if let Some(table) = document.get_mut("study").and_then(Item::as_table_like_mut) {
        set_text(table, "name", &format!("{}-explained", study.name));
    }
    place::relocate(&mut document, &study.file, to);
    let of_rates = study.infer.as_ref().is_some_and(|choice| !choice.sums.unknown.is_empty());
    let mut names = Vec::new();
    for term in terms {
        names.push(if of_rates {
            let name = new_name(&study.text, &names);
            enter(&mut document, term, &name)?;
            list(&mut document, "parameters", &name)?;
            name
        } else {
            list(&mut document, "functions", &term.function)?;
            format!("{}:{}", term.equation, term.function)
        });
    }
    let text = document.to_string();
    Study::from_text_for_inference(&to.join("explained.toml"), &text)?;
    Ok((text, names))
}

/// A name that the study does not have: `added1`, `added2`, …
fn new_name(text: &str, taken: &[String]) -> String {
    let mut number = 1;
    loop {
        let name = format!("added{number}");
        if !text.contains(&name) && !taken.contains(&name) {
            return name;
        }
        number += 1;
    }
}

/// Puts a term into the rate of its equation.
fn enter(document: &mut DocumentMut, term: &DriftTerm, coefficient: &str) -> Result<(), PatchError> {
    let new = format!("{coefficient}*({})", term.function);
    let mut found = false;
    let no_model = || PatchError::Text("`model` is no table".to_owned());
    let model = document.get_mut("model").and_then(Item::as_table_like_mut).ok_or_else(no_model)?;
    each_table(model, "states", &mut |state| {
        if text(state, "name") != term.equation {
            return;
        }
        found = true;
        if let Some(terms) = state.get_mut("rate").and_then(Item::as_table_like_mut) {
            terms.insert(coefficient, value(&new));
        } else {
            let rate = format!("{} + {new}", text(state, "rate"));
            set_text(state, "rate", &rate);
        }
    });
    if found { Ok(()) } else { Err(PatchError::NoTerm(term.equation.clone())) }
}

/// Puts a text into a list of `[infer]`, once.
fn list(document: &mut DocumentMut, key: &str, entry: &str) -> Result<(), PatchError> {
    let no_list = || PatchError::Text(format!("`infer` has no list `{key}`"));
    let infer = document.get_mut("infer").and_then(Item::as_table_like_mut).ok_or_else(no_list)?;
    if !infer.contains_key(key) {
        infer.insert(key, Item::Value(Value::Array(Array::new())));
    }
    let entries = array(infer, key).ok_or_else(no_list)?;
    if !entries.iter().any(|known| known.as_str() == Some(entry)) {
        entries.push(entry);
    }
    Ok(())
}
