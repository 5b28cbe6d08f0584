//! Where members start: the last row that was inferred from, and the rows after it.
//!
//! Next file to read: `model.rs`.

use starlings_study::infer_choice::InferRecord;

use crate::blocks::open;
use crate::error::InferError;

/// The last row that was inferred from: states, then inputs.
pub(super) struct LastRow {
    pub(super) time: f64,
    pub(super) values: Vec<f64>,
}

/// Rows after it that nothing was inferred from.
#[derive(Default)]
pub(super) struct After {
    pub(super) times: Vec<f64>,
    pub(super) rows: Vec<Vec<f64>>,
}

/// Reads a recording up to a time, or to its end.
///
/// # Errors
/// When it cannot be read, or has no row in its span.
pub(super) fn read(record: &InferRecord, until: Option<f64>) -> Result<(LastRow, After), InferError> {
    let mut rows = open(record)?;
    let mut values = vec![0.0; record.columns.len()];
    let mut last = LastRow { time: f64::NAN, values: values.clone() };
    let mut after = After::default();
    let until = until.unwrap_or(f64::INFINITY);
    while let Some(row) = rows.next(&mut values)? {
        if row.time < record.span[0] {
            continue;
        }
        if row.time <= record.span[1] {
            last.time = row.time;
            last.values.copy_from_slice(&values);
        } else if row.time <= until {
            after.times.push(row.time);
            after.rows.push(values.clone());
        } else {
            break;
        }
    }
    if last.time.is_nan() {
        let message = format!("record `{}` has no row in its span", record.name);
        return Err(rows.fault(None, message, "a forecast begins at the last one"));
    }
    Ok((last, after))
}
