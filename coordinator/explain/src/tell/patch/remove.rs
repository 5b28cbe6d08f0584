//! Rate terms that effects take the place of, and what nobody uses any more once they are gone.

use std::collections::BTreeSet;

use starlings_models::equations::Expression;
use toml_edit::{Array, DocumentMut, Item, TableLike, Value, value};

use super::{PatchError, array, each_table, text};

/// Takes a named term out of every rate that has it; a rate without terms is zero.
pub(super) fn term(document: &mut DocumentMut, term: &str) -> Result<(), PatchError> {
    let missing = || PatchError::NoTerm(term.to_owned());
    let model = document.get_mut("model").and_then(Item::as_table_like_mut).ok_or_else(missing)?;
    let mut found = false;
    each_table(model, "states", &mut |state| {
        // A rate written as one text is a term named as its state.
        let whole = text(state, "name") == term && state.get("rate").is_some_and(Item::is_str);
        let terms = state.get_mut("rate").and_then(Item::as_table_like_mut);
        let taken = terms.is_some_and(|terms| terms.remove(term).is_some());
        let empty = state.get("rate").and_then(Item::as_table_like).is_some_and(TableLike::is_empty);
        if whole || (taken && empty) {
            state.insert("rate", value("0"));
        }
        found |= whole || taken;
    });
    if let Some(list) = array(model, "replaceable") {
        list.retain(|name| name.as_str() != Some(term));
    }
    if found { Ok(()) } else { Err(missing()) }
}

/// Takes out the parameters and constants that no expression names any more, and the described effects that need them.
pub(super) fn orphans(document: &mut DocumentMut) -> Result<(), PatchError> {
    let of_model = names_in_model(document)?;
    let (own, in_terms) = names_in_effects(document)?;
    let parameters: BTreeSet<String> = of_model.union(&own).cloned().collect();
    let constants: BTreeSet<String> = parameters.union(&in_terms).cloned().collect();
    let mut dropped = BTreeSet::new();
    retain(document.as_table_mut(), "parameters", &mut |table| {
        let name = text(table, "name");
        let kept = name.starts_with("initial:") || parameters.contains(&name);
        if !kept {
            dropped.insert(name);
        }
        kept
    });
    if let Some(model) = document.get_mut("model").and_then(Item::as_table_like_mut) {
        for (key, used) in [("constants", &constants), ("roles", &of_model)] {
            let Some(list) = model.get_mut(key).and_then(Item::as_table_like_mut) else { continue };
            let known: Vec<String> = list.iter().map(|(name, _)| name.to_owned()).collect();
            for name in known.iter().filter(|n| !n.starts_with("initial:") && !used.contains(*n)) {
                list.remove(name);
            }
        }
    }
    let mut fault = None;
    retain(document.as_table_mut(), "effects", &mut |table| match names_in_effect(table) {
        Ok((_, terms)) => terms.is_disjoint(&dropped),
        Err(error) => {
            fault = Some(error);
            true
        }
    });
    fault.map_or(Ok(()), Err)
}

/// Keeps the tables of a list for which `keep` holds.
fn retain(root: &mut dyn TableLike, key: &str, keep: &mut dyn FnMut(&dyn TableLike) -> bool) {
    match root.get_mut(key) {
        Some(Item::ArrayOfTables(list)) => list.retain(|table| keep(table)),
        Some(Item::Value(Value::Array(list))) => {
            list.retain(|entry| entry.as_inline_table().is_none_or(|table| keep(table)));
        }
        _ => {}
    }
}

fn names_of(expression: &str, names: &mut BTreeSet<String>) -> Result<(), PatchError> {
    if !expression.is_empty() {
        let parsed = Expression::parse(expression).map_err(|e| PatchError::Text(e.message))?;
        names.extend(parsed.names().into_iter().map(|(name, _)| name));
    }
    Ok(())
}

/// Names in rates, initial values and outputs.
fn names_in_model(document: &DocumentMut) -> Result<BTreeSet<String>, PatchError> {
    let mut names = BTreeSet::new();
    let Some(model) = document.get("model").and_then(Item::as_table_like) else { return Ok(names) };
    for state in tables(model, "states") {
        names_of(&text(state, "initial"), &mut names)?;
        names_of(&text(state, "rate"), &mut names)?;
        for (_, term) in state.get("rate").and_then(Item::as_table_like).into_iter().flat_map(TableLike::iter)
        {
            names_of(term.as_str().unwrap_or_default(), &mut names)?;
        }
    }
    for output in tables(model, "outputs") {
        names_of(&text(output, "value"), &mut names)?;
    }
    Ok(names)
}

/// Parameters of all effects, and the names in their terms.
fn names_in_effects(document: &DocumentMut) -> Result<(BTreeSet<String>, BTreeSet<String>), PatchError> {
    let (mut own, mut terms) = (BTreeSet::new(), BTreeSet::new());
    for effect in tables(document.as_table(), "effects") {
        let (parameters, names) = names_in_effect(effect)?;
        own.extend(parameters);
        terms.extend(names);
    }
    Ok((own, terms))
}

fn names_in_effect(effect: &dyn TableLike) -> Result<(BTreeSet<String>, BTreeSet<String>), PatchError> {
    let own = tables(effect, "parameters").into_iter().map(|p| text(p, "name")).collect();
    let mut names = BTreeSet::new();
    for add in tables(effect, "adds") {
        names_of(&text(add, "term"), &mut names)?;
    }
    for state in tables(effect, "states") {
        names_of(&text(state, "rate"), &mut names)?;
        names_of(&text(state, "initial"), &mut names)?;
    }
    Ok((own, names))
}

/// The tables of a list, however it is written.
fn tables<'a>(parent: &'a dyn TableLike, key: &str) -> Vec<&'a dyn TableLike> {
    match parent.get(key) {
        Some(Item::ArrayOfTables(list)) => list.iter().map(|table| table as &dyn TableLike).collect(),
        Some(Item::Value(Value::Array(list))) => inline_tables(list),
        _ => Vec::new(),
    }
}

fn inline_tables(list: &Array) -> Vec<&dyn TableLike> {
    list.iter().filter_map(Value::as_inline_table).map(|table| table as &dyn TableLike).collect()
}
