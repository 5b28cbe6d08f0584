//! Where the run of a record begins, and the rows of a held-out record that tell its initial values.
//!
//! Next file to read: [`super::channel`].

use starlings_models::{Signal, Spec};

use super::Table;
use crate::checked::Channel;
use crate::file::RecordSection;
use crate::problem::Source;

/// The start of the run: the first measured time, or the one before it that the study gives. `None` when a problem was reported.
pub(super) fn of_run(source: &Source, section: &RecordSection, times: &[f64]) -> Option<f64> {
    let first = *times.first()?;
    let Some(start) = &section.start else { return Some(first) };
    let value = *start.get_ref();
    if value <= first && value.is_finite() {
        return Some(value);
    }
    source.report_with(
        start.span(),
        format!("record `{}` starts at {value}, after its first measured row at {first}", section.name.get_ref()),
        format!("`start` begins the run earlier, so that the model settles: give {first} or less; `train` leaves rows out"),
    );
    None
}

/// Rows of the record's own file before the first measured one, where nothing says that the run begins there: a dose that is given before the first
/// sample, or a first value that is missing. An input of another file keeps its own times.
pub(super) fn rows_before(
    section: &RecordSection,
    table: &Table,
    times: &[f64],
    inputs: &[Signal],
    spec: &Spec,
) -> Option<String> {
    let first = *times.first()?;
    if section.start.is_some() {
        return None;
    }
    let is_own = |name: &String| {
        section
            .inputs
            .iter()
            .any(|(input, column)| input.get_ref() == name && table.csv.headers.contains(column.get_ref()))
    };
    let own = spec.inputs.iter().zip(inputs).filter(|(input, _)| is_own(&input.name));
    let of_inputs = own.filter_map(|(_, signal)| signal.times.first().copied()).reduce(f64::min);
    let (earliest, what, cure) = if let Some(earliest) = of_inputs.filter(|time| *time < first) {
        (
            earliest,
            format!("its inputs from {earliest} on act before that on nothing but delays"),
            "where the model is to feel them, with its initial values at that time",
        )
    } else {
        let earliest =
            *table.times.first().filter(|time| **time < first && is_empty_before(section, table, first))?;
        let file = section.file.get_ref();
        (
            earliest,
            format!("the rows of `{file}` from {earliest} on hold no value of a channel before that"),
            "where the initial values are those at that time",
        )
    };
    Some(format!(
        "record `{}` begins with its first measured row, at {first}: {what}. Write `start = {earliest}` in the record {cure}; \
         `start = {first}` keeps the run as it is.",
        section.name.get_ref()
    ))
}

/// Whether no column of a channel has a value before a time: what is derived from one may begin later.
fn is_empty_before(section: &RecordSection, table: &Table, first: f64) -> bool {
    let column = |name: &String| table.csv.index(name).ok().and_then(|column| table.csv.numbers(column).ok());
    let columns = section.channels.iter().filter_map(|channel| column(channel.column.get_ref()));
    let rows = columns.filter_map(|values| values.iter().position(|value| value.is_finite()));
    rows.min().is_some_and(|row| table.times[row] >= first)
}

/// The span of the first rows of a held-out record that its initial values are found from; `None` where the study gives none, or
/// a problem was reported.
pub(super) fn first_rows(
    source: &Source,
    section: &RecordSection,
    times: &[f64],
    channels: &[Channel],
) -> Option<[f64; 2]> {
    let rows = section.start_rows.as_ref()?;
    let name = section.name.get_ref();
    if !section.held_out {
        let message = format!("record `{name}` is fitted, so its start is too");
        source.report_with(rows.span(), message, "remove `start_rows`, or add `use = \"held-out\"`");
        return None;
    }
    let measured = |row: &usize| channels.iter().any(|c| !c.held_out && c.values[*row].is_finite());
    let seen: Vec<f64> = (0..times.len()).filter(measured).map(|row| times[row]).collect();
    let n = usize::try_from(*rows.get_ref()).unwrap_or(usize::MAX);
    if n == 0 || n >= seen.len() {
        source.report_with(
            rows.span(),
            format!("`start_rows` is {n}, but record `{name}` has {} rows that a fit could see", seen.len()),
            "give at least 1, and leave rows that are held out",
        );
        return None;
    }
    Some([times[0], seen[n - 1]])
}
