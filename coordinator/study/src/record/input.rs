//! The input signals of a record: complete, and as long as the record.
//!
//! Next file to read: [`crate::plan`].

use starlings_models::{Signal, Spec, nearest, quoted_list};
use toml::Spanned;

use super::{Recordings, Table};
use crate::file::RecordSection;
use crate::problem::Source;

/// The signals in the order of the model's inputs; `None` when a problem was reported.
pub(crate) fn inputs(
    files: &mut Recordings<'_>,
    section: &RecordSection,
    table: &Table,
    times: &[f64],
    spec: &Spec,
) -> Option<Vec<Signal>> {
    let before = files.source.count();
    let known: Vec<String> = spec.inputs.iter().map(|q| q.name.clone()).collect();
    // A misspelt input is told once, not also as a missing one.
    let meant = unknown_names(files.source, section, spec);
    let mut signals = Vec::new();
    for input in &known {
        if let Some((_, column)) = section.inputs.iter().find(|(n, _)| n.get_ref() == input) {
            signals.extend(
                signal(files, section, table, column).filter(|s| covers(files, section, s, times, column)),
            );
        } else if !meant.contains(input) {
            let record = section.name.get_ref();
            let message = format!("record `{record}` lacks the input `{input}` of model `{}`", spec.kind);
            let columns = quoted_list(&table.csv.headers);
            let help = format!("add `inputs = {{ {input} = \"<column>\" }}`; columns: {columns}");
            files.source.report_with(section.span.clone(), message, help);
        }
    }
    (files.source.count() == before).then_some(signals)
}

/// Reports names that are no inputs of the model; returns the inputs that they probably mean.
pub(super) fn unknown_names(source: &Source, section: &RecordSection, spec: &Spec) -> Vec<String> {
    let known: Vec<String> = spec.inputs.iter().map(|q| q.name.clone()).collect();
    let mut meant = Vec::new();
    for (name, _) in section.inputs.iter().filter(|(n, _)| !known.contains(n.get_ref())) {
        meant.extend(nearest(name.get_ref(), &known));
        let message = format!("model `{}` has no input `{}`", spec.kind, name.get_ref());
        if known.is_empty() {
            source.report_with(name.span(), message, "it needs none: remove `inputs`");
        } else {
            source.report_unknown(name.span(), message, &known);
        }
    }
    meant
}

/// One signal: a column of the record's file, or `file:column`.
pub(super) fn signal(
    files: &mut Recordings<'_>,
    section: &RecordSection,
    table: &Table,
    written: &Spanned<String>,
) -> Option<Signal> {
    let text = written.get_ref();
    let elsewhere = text.rsplit_once(':').filter(|_| !table.csv.headers.contains(text));
    let other;
    let (from, column) = match elsewhere {
        None => (table, text.as_str()),
        Some((file, column)) => {
            other = files.table(file, written, &section.time)?;
            (&other, column)
        }
    };
    let index = match from.csv.index(column) {
        Ok(index) => index,
        Err((message, help)) => {
            files.source.report_with(written.span(), message, help);
            return None;
        }
    };
    let values = match from.csv.numbers(index) {
        Ok(values) => values,
        Err(problem) => {
            files.source.adopt(problem);
            return None;
        }
    };
    let missing: Vec<usize> = (0..values.len()).filter(|row| values[*row].is_nan()).collect();
    let Some(&first) = missing.first() else {
        return Some(Signal { times: from.times.clone(), values });
    };
    let n = missing.len();
    let message = format!(
        "input column `{column}` misses {n} value{}, the first on line {} at {} = {}",
        if n == 1 { "" } else { "s" },
        from.csv.line(first),
        from.csv.headers[from.time_column],
        from.times[first],
    );
    let time = section.time.get_ref();
    let help = format!(
        "an input must be complete: fill it, or put it into a file with a `{time}` column of its own, as \"other.csv:{column}\""
    );
    files.source.adopt(from.csv.problem(first, index, message, &help));
    None
}

/// Whether a signal spans the record's observation times; otherwise says so.
fn covers(
    files: &Recordings<'_>,
    section: &RecordSection,
    signal: &Signal,
    times: &[f64],
    written: &Spanned<String>,
) -> bool {
    let (Some(from), Some(to)) = (signal.times.first(), signal.times.last()) else { return false };
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return false };
    let first = section.start.as_ref().map_or(first, |start| start.get_ref());
    if from <= first && last <= to {
        return true;
    }
    let message = format!(
        "input `{}` covers {from} to {to}, but record `{}` is run from {first} to {last}",
        written.get_ref(),
        section.name.get_ref()
    );
    files.source.report_with(
        written.span(),
        message,
        "an input must cover the start and every observation time of its record",
    );
    false
}
