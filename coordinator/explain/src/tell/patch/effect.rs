//! An effect and its parameters, written into a study.
//!
//! An effect that the study describes already is not written a second time: a value for its parameters makes it part of the
//! model. Next file to read: [`super::prior`].

use starlings_models::EffectDef;
use starlings_models::effect::{Addition, EffectParameter, EffectState};
use starlings_study::Study;
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value, value};

use super::{PatchEffect, PatchError, prior};
use crate::tell::result::Coefficient;

/// Puts an effect into the model of the study.
pub(super) fn add(document: &mut DocumentMut, study: &Study, found: &PatchEffect) -> Result<(), PatchError> {
    let def = &found.def;
    let described =
        study.setup.effects.iter().chain(study.candidates.iter()).any(|known| known.name == def.name);
    if !described {
        append(document.as_table_mut(), "effects", described_effect(def))?;
    }
    for coefficient in &found.values {
        let name = &coefficient.name;
        let known = study.setup.parameters.contains(name) || study.setup.model.constants.contains_key(name);
        if known {
            continue;
        }
        if coefficient.sd > 0.0 && coefficient.sd.is_finite() {
            let range = def.parameters.iter().find(|p| p.name == *name).map_or(NO_BOUNDS, |p| p.range);
            append(document.as_table_mut(), "parameters", parameter(coefficient, range, def))?;
        } else {
            constant(document, name, coefficient.estimate)?;
        }
    }
    Ok(())
}

const NO_BOUNDS: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Adds a table to a list of tables, in the way in which the list is written.
fn append(root: &mut Table, key: &str, table: Table) -> Result<(), PatchError> {
    match root.entry(key).or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new())) {
        Item::ArrayOfTables(list) => list.push(table),
        Item::Value(Value::Array(list)) => list.push(table.into_inline_table()),
        _ => return Err(PatchError::Text(format!("`{key}` is no list of tables"))),
    }
    Ok(())
}

fn described_effect(def: &EffectDef) -> Table {
    let mut table = Table::new();
    table.decor_mut().set_prefix("\n# Added by `starlings explain`.\n");
    table.insert("name", value(&def.name));
    if let Some(built_in) = def.built_in.as_ref().filter(|_| def.adds.is_empty()) {
        table.insert("built_in", value(built_in));
        return table;
    }
    for (key, text) in [("says", &def.says), ("source", &def.source)] {
        if !text.is_empty() {
            table.insert(key, value(text));
        }
    }
    table.insert("adds", value(def.adds.iter().map(addition).collect::<Array>()));
    table.insert("parameters", value(def.parameters.iter().map(effect_parameter).collect::<Array>()));
    if !def.states.is_empty() {
        table.insert("states", value(def.states.iter().map(state).collect::<Array>()));
    }
    if !def.confounders.is_empty() {
        table.insert("confounders", value(def.confounders.iter().map(String::as_str).collect::<Array>()));
    }
    table
}

fn inline(entries: impl IntoIterator<Item = (&'static str, Value)>) -> InlineTable {
    let mut table = InlineTable::new();
    for (key, entry) in entries {
        table.insert(key, entry);
    }
    table
}

fn addition(addition: &Addition) -> InlineTable {
    inline([("to", addition.to.as_str().into()), ("term", addition.term.as_str().into())])
}

fn effect_parameter(parameter: &EffectParameter) -> InlineTable {
    let mut table = inline([("name", parameter.name.as_str().into())]);
    if !parameter.unit.is_empty() {
        table.insert("unit", parameter.unit.as_str().into());
    }
    if parameter.range.iter().any(|bound| bound.is_finite()) {
        table.insert("range", Value::Array(parameter.range.into_iter().collect()));
    }
    if !parameter.grid.is_empty() {
        table.insert("grid", Value::Array(parameter.grid.iter().copied().collect()));
    }
    if parameter.is_rounding {
        table.insert("rounds", true.into());
    }
    table
}

fn state(state: &EffectState) -> InlineTable {
    let mut table = inline([("name", state.name.as_str().into())]);
    for (key, text) in [("unit", &state.unit), ("initial", &state.initial)] {
        if !text.is_empty() {
            table.insert(key, text.as_str().into());
        }
    }
    table.insert("rate", state.rate.as_str().into());
    table
}

fn parameter(coefficient: &Coefficient, range: [f64; 2], def: &EffectDef) -> Table {
    let mut table = Table::new();
    let of = &def.name;
    table.decor_mut().set_prefix(format!(
        "\n# Of the effect `{of}`; the median is the estimate of `starlings explain`, the spread is wide on purpose.\n"
    ));
    table.insert("name", value(&coefficient.name));
    if !coefficient.unit.is_empty() {
        table.insert("unit", value(&coefficient.unit));
    }
    table.insert("prior", value(prior::prior(coefficient, range)));
    table
}

/// A value that was not estimated stands among the model's constants.
fn constant(document: &mut DocumentMut, name: &str, number: f64) -> Result<(), PatchError> {
    let no_model = || PatchError::Text("`model` is no table".to_owned());
    let model = document.get_mut("model").and_then(Item::as_table_like_mut).ok_or_else(no_model)?;
    if model.get("constants").is_none() {
        model.insert("constants", value(InlineTable::new()));
    }
    let constants = model.get_mut("constants").and_then(Item::as_table_like_mut);
    constants
        .ok_or_else(|| PatchError::Text("`constants` is no table".to_owned()))?
        .insert(name, value(number));
    Ok(())
}
