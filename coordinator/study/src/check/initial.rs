//! Initial values from a file: `[model] initial = "initial.csv"`, one row `state,value` per component.
//!
//! They become constants `initial:<state>`, the same for every record. A parameter of the same name takes a constant's place:
//! that value is estimated. Next file to read: [`super::model`].

use std::collections::BTreeMap;

use starlings_models::Spec;
use toml::Spanned;

use crate::expand::INITIAL;
use crate::field::{component_of, components, field_of};
use crate::file::StudyFile;
use crate::problem::{Source, suggestion};
use crate::record::{Csv, Recordings};

/// The values of the file by constant name, empty without one; every fault is reported.
pub(crate) fn constants(
    source: &Source,
    file: &StudyFile,
    spec: &Spec,
    warnings: &mut Vec<String>,
) -> BTreeMap<String, f64> {
    let mut values = BTreeMap::new();
    let Some(name) = &file.model.initial else { return values };
    let Some(csv) = Recordings::new(source).open(name.get_ref(), name) else { return values };
    let column = |wanted| column(source, name, &csv, wanted);
    let (Some(states), Some(of_values)) = (column("state"), column("value")) else { return values };
    let numbers = match csv.numbers(of_values) {
        Ok(numbers) => numbers,
        Err(problem) => {
            source.adopt(problem);
            return values;
        }
    };
    let known = components(&spec.states);
    for (row, (state, value)) in csv.texts(states).zip(numbers).enumerate() {
        let complain = |column: usize, message: String, help: &str| {
            source.adopt(csv.problem(row, column, message, help));
        };
        let constant = format!("{INITIAL}{state}");
        if !known.iter().any(|k| k == state) {
            let (message, help) = unknown(spec, state);
            complain(states, message, &help);
        } else if value.is_nan() {
            complain(of_values, format!("state `{state}` has no value"), "every row needs its value");
        } else if values.insert(constant.clone(), value).is_some()
            || file.model.constants.iter().any(|(name, _)| *name.get_ref() == constant)
        {
            complain(states, format!("`{constant}` is given twice"), "remove one of the two values");
        }
    }
    values.retain(|name, _| !file.parameters.iter().any(|p| p.name.get_ref() == name));
    warnings.extend(incomplete(spec, &values, name.get_ref()));
    values
}

fn column(source: &Source, name: &Spanned<String>, csv: &Csv, column: &str) -> Option<usize> {
    let found = csv.index(column);
    found
        .map_err(|(message, help)| {
            let help = format!("a file of initial values has the columns `state` and `value`; {help}");
            source.report_with(name.span(), message, help);
        })
        .ok()
}

fn unknown(spec: &Spec, state: &str) -> (String, String) {
    if let Some(q) = spec.states.iter().find(|q| q.name == state) {
        let message = format!("state `{state}` has {} components", q.size);
        return (message, format!("give each its row, `{state}[0]` to `{state}[{}]`", q.size - 1));
    }
    let names: Vec<String> = spec.states.iter().map(|q| q.name.clone()).collect();
    let message = format!("model `{}` has no state `{state}`", spec.kind);
    let field = component_of(state).and_then(|(field, _)| spec.states.iter().find(|q| q.name == field));
    let help = match field {
        Some(q) if q.size == 1 => format!("`{}` is a scalar", q.name),
        Some(q) => format!("its components are `{0}[0]` to `{0}[{1}]`", q.name, q.size - 1),
        None => suggestion(state, &names).unwrap_or_default(),
    };
    (message, help)
}

/// A field of which some components are given and others not: likely a file made with another layout.
fn incomplete(spec: &Spec, values: &BTreeMap<String, f64>, file: &str) -> Vec<String> {
    let given = |q: &&starlings_models::Quantity| {
        let names = values.keys().filter_map(|name| name.strip_prefix(INITIAL));
        names.filter(|name| field_of(name) == q.name).count()
    };
    let partly = spec.states.iter().filter(|q| (1..q.size).contains(&given(q)));
    partly
        .map(|q| {
            format!(
                "`{file}` gives initial values to {} of the {} components of `{}`: the others start as the model does.",
                given(&q),
                q.size,
                q.name
            )
        })
        .collect()
}
