//! Single values of a state that stand apart from the rows around them, as a sensor's spikes do: they are told, not left out.
//!
//! One such value in ten thousand rows is taken for errors of the measurement, coarse steps or a change of the coefficients, by which these are
//! off by many of their standard deviations. What stands apart is the estimators' (`estimators/src/outliers.rs`), which asks how many
//! rows scatter together; noise may be larger in some states than in others, so that a value has to stand apart from the rows near it
//! alone, too. Next file to read: `doubts.rs`, for what is doubtful of a recording as a whole.

use starlings_estimators::{are_too_many, outliers};
use starlings_models::units::rounded;
use starlings_study::infer_choice::{InferChoice, InferRecord, MeasuredChoice};

use crate::blocks::{Start, length, open};
use crate::error::InferError;
use crate::run::Asked;

/// Rows of all records together up to which they are looked through, since the files are read once more.
const MOST: f64 = 2e6;
/// Rows that are held at once.
const HELD: usize = 1 << 16;
/// Rows on either side of a value that it has to stand apart from.
const AROUND: usize = 32;
/// Values that are named at most.
const NAMED: usize = 4;

/// Rows of a record, its states column by column.
struct Columns {
    times: Vec<f64>,
    lines: Vec<u64>,
    values: Vec<Vec<f64>>,
    /// The first of them that was not judged yet.
    next: usize,
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
        found.extend(of_record(record, asked, unit).unwrap_or_default());
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

/// The values of a record that stand apart, each in words, in the order of the file.
fn of_record(record: &InferRecord, asked: &Asked<'_>, unit: &str) -> Result<Vec<String>, InferError> {
    let (mut rows, n_state) = (open(record)?, asked.question.basis.n_state());
    let mut of_row = vec![0.0; record.columns.len()];
    let values = vec![Vec::new(); n_state];
    let mut columns = Columns { times: Vec::new(), lines: Vec::new(), values, next: 0 };
    let mut found = Vec::new();
    while let Some(row) = rows.next(&mut of_row)? {
        if row.time < record.span[0] || row.time > record.span[1] {
            continue;
        }
        columns.times.push(row.time);
        columns.lines.push(row.line);
        for (column, value) in columns.values.iter_mut().zip(&of_row) {
            column.push(*value);
        }
        if columns.times.len() == HELD {
            found.extend(columns.said(HELD - AROUND, record, asked, unit));
            columns.forget();
        }
    }
    found.extend(columns.said(columns.times.len(), record, asked, unit));
    Ok(found)
}

impl Columns {
    /// The values that stand apart, of rows up to `to` that were not judged yet, each in words.
    fn said(&mut self, to: usize, record: &InferRecord, asked: &Asked<'_>, unit: &str) -> Vec<String> {
        let mut found = Vec::new();
        for (name, of_state) in asked.question.structure.equations().iter().zip(&self.values) {
            let all = apart(&self.times, of_state, asked.choice).into_iter();
            for (at, distance, by) in all.filter(|(at, ..)| (self.next..to).contains(at)) {
                let text = format!(
                    "{name} in line {} of record `{}` (at {} {unit}, {} from the line between its neighbours, {} times how others scatter)",
                    self.lines[at],
                    record.name,
                    rounded(self.times[at], 9),
                    rounded(distance, 2),
                    rounded(by, 2),
                );
                found.push((at, text));
            }
        }
        self.next = to;
        found.sort_by_key(|(at, _)| *at);
        found.into_iter().map(|(_, text)| text).collect()
    }

    /// Keeps the rows that were not judged yet, and those that they are judged by.
    fn forget(&mut self) {
        let n = self.next.saturating_sub(AROUND);
        self.times.drain(..n);
        self.lines.drain(..n);
        self.values.iter_mut().for_each(|column| drop(column.drain(..n)));
        self.next -= n;
    }
}

/// Rows whose value stands apart among all that are held and among the rows near it, with how far and how many times as far as these scatter.
fn apart(times: &[f64], values: &[f64], choice: &InferChoice) -> Vec<(usize, f64, f64)> {
    let noise = if let MeasuredChoice::Known(sd) = choice.measured { Some(sd) } else { None };
    let near = |at: usize| {
        let (from, to) = (at.saturating_sub(AROUND), (at + AROUND + 1).min(values.len()));
        let found = outliers(&times[from..to], &values[from..to], noise);
        found.into_iter().find(|near| near.at + from == at)
    };
    let all = outliers(times, values, noise);
    if are_too_many(&all, values) {
        return Vec::new();
    }
    all.into_iter()
        .filter_map(|stray| near(stray.at).map(|near| (stray.at, near.distance, near.times.min(stray.times))))
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
