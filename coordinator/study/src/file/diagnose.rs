//! `[diagnose]` of a study: the scenarios that a fault may have followed.
//!
//! Next file to read: [`crate::check`].

use std::ops::Range;

use toml::Spanned;

use super::read::parameters;
use super::table::{Table, named_texts, number};
use super::{Named, ParameterSection};
use crate::problem::Source;

/// `[diagnose]`.
#[derive(Debug)]
pub(crate) struct DiagnoseSection {
    pub(crate) span: Range<usize>,
    pub(crate) false_alarm: Option<Spanned<f64>>,
    pub(crate) scenarios: Vec<ScenarioSection>,
}

/// `[[diagnose.scenarios]]`.
#[derive(Debug)]
pub(crate) struct ScenarioSection {
    pub(crate) span: Range<usize>,
    pub(crate) name: Spanned<String>,
    pub(crate) says: String,
    /// What is unknown of it, the severity first.
    pub(crate) parameters: Vec<ParameterSection>,
    /// Values of parameters of the model.
    pub(crate) set: Named<f64>,
    /// Inputs that are others than those of the records.
    pub(crate) inputs: Named<String>,
    /// Values from which a search starts, by parameter.
    pub(crate) grid: Vec<(Spanned<String>, Vec<Spanned<f64>>)>,
    /// How likely it is beforehand, up to a factor.
    pub(crate) weight: Option<Spanned<f64>>,
}

const KEYS: [&str; 7] = ["name", "says", "parameters", "set", "inputs", "grid", "weight"];

/// Reads the section; `None` where the file has none.
pub(crate) fn read(source: &Source, root: &Table<'_>) -> Option<DiagnoseSection> {
    let t = root.table("diagnose", "[diagnose]", &["false_alarm", "scenarios"])?;
    let scenarios = t.tables("scenarios", "[[diagnose.scenarios]]", &KEYS);
    Some(DiagnoseSection {
        span: t.span.clone(),
        false_alarm: t.number("false_alarm"),
        scenarios: scenarios.iter().map(|t| scenario(source, t)).collect(),
    })
}

fn scenario(source: &Source, t: &Table<'_>) -> ScenarioSection {
    if t.get("parameters").is_none() {
        t.missing(
            "parameters",
            "what is unknown of it, each with a `name` and a `prior`, the severity first",
        );
    }
    let set = t.free_entries("set");
    let value = |(key, node): &(Spanned<String>, &super::table::Node<'_>)| {
        number(source, node, &format!("`{}`", key.get_ref())).map(|value| (key.clone(), value))
    };
    let grid = t.free_entries("grid");
    let names: Vec<&str> = grid.iter().map(|(key, _)| key.get_ref().as_str()).collect();
    let values = t.table("grid", "`grid`", &names);
    let starts = |(key, _): &(Spanned<String>, &super::table::Node<'_>)| {
        (key.clone(), values.as_ref().map(|t| t.numbers(key.get_ref())).unwrap_or_default())
    };
    ScenarioSection {
        span: t.span.clone(),
        name: t.required_text("name", "a name for the scenario"),
        says: t.text("says").map(Spanned::into_inner).unwrap_or_default(),
        parameters: parameters(t),
        set: set.iter().filter_map(value).collect(),
        inputs: named_texts(source, &t.free_entries("inputs")),
        grid: grid.iter().map(starts).collect(),
        weight: t.number("weight"),
    }
}
