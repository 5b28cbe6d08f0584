//! Single values of a state that stand apart from the rows around them, as a sensor's spikes do: they are told, not left out.
//!
//! One such value in ten thousand rows is taken for errors of the measurement, coarse steps or a change of the coefficients, by which these are
//! off by many of their standard deviations. What stands apart is the estimators' (`estimators/src/outliers.rs`), which asks how a record
//! scatters as a whole; noise may be larger in some states than in others, so that a value has to stand apart from the rows near it
//! alone, too. Next file to read: `doubts.rs`, for what is doubtful of a recording as a whole.

use starlings_estimators::outliers;
use starlings_models::units::rounded;
use starlings_study::infer_choice::{InferChoice, InferRecord, MeasuredChoice};

use crate::blocks::{Start, length, open};
use crate::error::InferError;
use crate::run::Asked;

/// Rows of all records together up to which they are looked through: columns are held in memory, and the files are read once more.
const MOST: f64 = 2e6;
/// Rows on either side of a value that it has to stand apart from.
const AROUND: usize = 32;
/// Values that are named at most.
const NAMED: usize = 4;

/// The states of a record, column by column.
struct Columns {
    times: Vec<f64>,
    lines: Vec<u64>,
    values: Vec<Vec<f64>>,
}

/// What is said of values that stand apart; `None` where there is none, or nobody looked.
pub(crate) fn strays(asked: &Asked<'_>, at: Start, unit: &str) -> Option<String> {
    let choice = asked.choice;
    let (mut left, mut found) = (MOST, Vec::new());
    for record in &choice.records {
        left -= length(record) as f64 / at.per_row;
        if left < 0.0 {
            break;
        }
        // What is wrong with a file is told where it is summed.
        let Ok(columns) = read(record, asked.question.basis.n_state()) else { continue };
        found.extend(said(record, &columns, asked.question.structure.equations(), choice, unit));
    }
    words(&found, choice)
}

/// An error of an estimate with values that stand apart, which may be why there is none.
pub(crate) fn beside(error: InferError, strays: Option<&String>) -> InferError {
    match strays {
        Some(strays) => InferError::Strays { error: Box::new(error), strays: strays.clone() },
        None => error,
    }
}

fn read(record: &InferRecord, n_state: usize) -> Result<Columns, InferError> {
    let mut rows = open(record)?;
    let mut of_row = vec![0.0; record.columns.len()];
    let mut columns = Columns { times: Vec::new(), lines: Vec::new(), values: vec![Vec::new(); n_state] };
    while let Some(row) = rows.next(&mut of_row)? {
        if row.time < record.span[0] || row.time > record.span[1] {
            continue;
        }
        columns.times.push(row.time);
        columns.lines.push(row.line);
        for (column, value) in columns.values.iter_mut().zip(&of_row) {
            column.push(*value);
        }
    }
    Ok(columns)
}

/// The values of a record that stand apart, each in words, in the order of the file.
fn said(
    record: &InferRecord,
    columns: &Columns,
    names: &[String],
    choice: &InferChoice,
    unit: &str,
) -> Vec<String> {
    let Columns { times, lines, values } = columns;
    let mut found = Vec::new();
    for (name, of_state) in names.iter().zip(values) {
        for (at, distance, by) in apart(times, of_state, choice) {
            let text = format!(
                "{name} in line {} of record `{}` (at {} {unit}, {} from the line between its neighbours, {} times how others scatter)",
                lines[at],
                record.name,
                rounded(times[at], 9),
                rounded(distance, 2),
                rounded(by, 2),
            );
            found.push((at, text));
        }
    }
    found.sort_by_key(|(at, _)| *at);
    found.into_iter().map(|(_, text)| text).collect()
}

/// Rows whose value stands apart in the whole series and among the rows near it, with how far and how many times as far as these scatter.
fn apart(times: &[f64], values: &[f64], choice: &InferChoice) -> Vec<(usize, f64, f64)> {
    let noise = if let MeasuredChoice::Known(sd) = choice.measured { Some(sd) } else { None };
    let near = |at: usize| {
        let (from, to) = (at.saturating_sub(AROUND), (at + AROUND + 1).min(values.len()));
        let found = outliers(&times[from..to], &values[from..to], noise);
        found.into_iter().find(|near| near.at + from == at)
    };
    let all = outliers(times, values, noise).into_iter();
    all.filter_map(|stray| near(stray.at).map(|near| (stray.at, near.distance, near.times.min(stray.times))))
        .collect()
}

fn words(found: &[String], choice: &InferChoice) -> Option<String> {
    let mut list: Vec<String> = found.iter().take(NAMED).cloned().collect();
    if found.len() > NAMED {
        list.push(format!("{} more", found.len() - NAMED));
    }
    let remedy = match choice.measured {
        MeasuredChoice::Known(_) => {
            "put the mean of its neighbours in the place of such a value, or take the rows out, use gaps = \"break\" and measurement_noise = \"auto\""
        }
        _ if choice.breaks || choice.resample => "take these rows out of the file",
        _ => "take these rows out of the file and use gaps = \"break\" in [infer]",
    };
    (!list.is_empty()).then(|| {
        format!(
            "single values stand apart from all rows around them, as faults of a sensor do: {}; nothing is left out, and one such value counts as \
             errors of the measurement, coarse steps, noise that varies or a change, and moves coefficients out of their intervals: {remedy}",
            list.join(", ")
        )
    })
}
