//! Which column of a recording is which state or input.
//!
//! Next file to read: [`crate::infer_choice`].

use std::path::Path;

use starlings_models::equations::EquationsDef;
use starlings_models::quoted_list;

use crate::file::{RecordSection, StudyFile};
use crate::infer_choice::InferRecord;
use crate::problem::Source;

/// The recordings that are used, in the order of the file.
pub(super) fn records(source: &Source, file: &StudyFile, equations: &EquationsDef) -> Vec<InferRecord> {
    if file.records.iter().all(|record| record.held_out) {
        let end = source.text.len();
        let help = "add `[[records]]` with `name`, `file` and `channels`, without `use = \"held-out\"`";
        source.report_with(end..end, "the study has no record to infer from", help);
    }
    for (i, record) in file.records.iter().enumerate() {
        if file.records[..i].iter().any(|r| r.name.get_ref() == record.name.get_ref()) {
            let message = format!("two records are named `{}`", record.name.get_ref());
            source.report_with(record.name.span(), message, "names of records are unique in a study");
        }
    }
    let used = file.records.iter().filter(|record| !record.held_out);
    used.filter_map(|section| record(source, section, equations)).collect()
}

/// The recordings that nothing is inferred from, in the order of the file.
pub(super) fn held_out(source: &Source, file: &StudyFile, equations: &EquationsDef) -> Vec<InferRecord> {
    let held_out = file.records.iter().filter(|record| record.held_out);
    held_out.filter_map(|section| record(source, section, equations)).collect()
}

fn record(source: &Source, section: &RecordSection, equations: &EquationsDef) -> Option<InferRecord> {
    let start = section.start.as_ref().map(|start| ("start", start.span()));
    let rows = section.start_rows.as_ref().map(|rows| ("start_rows", rows.span()));
    for (key, span) in start.into_iter().chain(rows) {
        source.report_with(span, format!("an inference makes no runs that `{key}` could begin"), "remove it");
    }
    let said = section.channels.iter().filter_map(|channel| channel.outliers.as_ref());
    for outliers in said {
        source.report_with(
            outliers.span(),
            "an inference uses every value: `outliers` says nothing to it",
            "remove it",
        );
    }
    let before = source.count();
    let mut columns = Vec::new();
    for channel in &section.channels {
        let name = channel.output.get_ref();
        if let Some(what) =
            channel.surface.as_ref().map(|_| "a surface").or(channel.from.as_ref().map(|_| "`from`"))
        {
            let message = format!("`infer` needs the values of `{name}` as a column, not {what}");
            source.report(channel.output.span(), message);
        } else if state_of(equations, name).is_none() {
            unshown(source, channel, equations);
        }
    }
    for state in &equations.states {
        let shows = |name: &String| state_of(equations, name) == Some(state.name.as_str());
        let Some(channel) = section.channels.iter().find(|channel| shows(channel.output.get_ref())) else {
            unmeasured(source, section, &state.name);
            continue;
        };
        columns.push(channel.column.get_ref().clone());
    }
    for input in &equations.inputs {
        match section.inputs.iter().find(|(name, _)| *name.get_ref() == input.name) {
            Some((_, column)) if column.get_ref().contains(':') => {
                let message = format!("`infer` reads input `{}` from the record's own file", input.name);
                source.report_with(column.span(), message, "put the column beside those of the states");
            }
            Some((_, column)) => columns.push(column.get_ref().clone()),
            None => {
                let message = format!("record `{}` has no input `{}`", section.name.get_ref(), input.name);
                source.report_with(section.name.span(), message, "add it to `inputs = { ... }`");
            }
        }
    }
    let known: Vec<String> = equations.inputs.iter().map(|input| input.name.clone()).collect();
    for (name, _) in section.inputs.iter().filter(|(name, _)| !known.contains(name.get_ref())) {
        source.report_unknown(name.span(), format!("the model has no input `{}`", name.get_ref()), &known);
    }
    let folder = source.file.parent().unwrap_or(Path::new(""));
    (source.count() == before).then(|| InferRecord {
        name: section.name.get_ref().clone(),
        file: folder.join(section.file.get_ref()),
        time: section.time.get_ref().clone(),
        columns,
        span: section.train.as_ref().map_or([f64::NEG_INFINITY, f64::INFINITY], |span| *span.get_ref()),
    })
}

/// Reports a state that no channel measures.
fn unmeasured(source: &Source, section: &RecordSection, state: &str) {
    let message = format!("no channel of record `{}` measures state `{state}`", section.name.get_ref());
    let help = format!(
        "an inference needs every state: add a channel of an output with `value = \"{state}\"`, or take what is known of it as an input"
    );
    source.report_with(section.name.span(), message, help);
}

/// The state that an output is, without anything added.
fn state_of<'a>(equations: &'a EquationsDef, output: &str) -> Option<&'a str> {
    let value = equations.outputs.iter().find(|o| o.name == output)?.value.trim();
    equations.states.iter().map(|state| state.name.as_str()).find(|state| *state == value)
}

/// Reports an output that is no state.
fn unshown(source: &Source, channel: &crate::file::ChannelSection, equations: &EquationsDef) {
    let name = channel.output.get_ref();
    let all: Vec<String> = equations.outputs.iter().map(|output| output.name.clone()).collect();
    if !all.contains(name) {
        source.report_unknown(channel.output.span(), format!("the model has no output `{name}`"), &all);
        return;
    }
    let states: Vec<&str> = equations.states.iter().map(|state| state.name.as_str()).collect();
    let message = format!("output `{name}` is no state by itself, and an inference needs the states");
    let help = format!("measure outputs whose `value` is a state, one of {}", quoted_list(&states));
    source.report_with(channel.output.span(), message, help);
}
