//! Rows at equal steps out of rows that are not: linear between neighbours, where a study asks for it.
//!
//! Between two rows the path is a straight line and has less noise than it had: of D a share of h/3H is missing in single steps H that rows h apart
//! were interpolated to, and neighbouring steps share what is missing, so that residuals at lag zero and one together have all of it (the
//! Brownian bridge; `estimators/src/inference/diffusion.rs`). Rows further apart than two steps are a gap. Next file to read: `blocks.rs`.

use std::io::Read;

use crate::error::InferError;
use crate::rows::{Row, Rows};

/// Steps beyond which nothing is known between two rows.
const GAP: f64 = 2.0;
/// Part of a step by which a row may lie behind a time that it stands for.
const SAME: f64 = 1e-9;

/// Rows as they are, or at equal steps.
pub(crate) struct Feed<R> {
    rows: Rows<R>,
    grid: Option<Grid>,
}

/// Where a recording is resampled.
struct Grid {
    step: f64,
    /// Time of the piece's first row, and the number of the next time after it.
    start: f64,
    next: u64,
    /// Rows around the next time; times are NaN before the first row.
    before: (f64, Vec<f64>),
    after: (f64, Vec<f64>),
    line: u64,
}

impl<R: Read> Feed<R> {
    /// Rows of so many values, at equal steps where these are given.
    pub(crate) fn new(rows: Rows<R>, resample: Option<f64>, width: usize) -> Self {
        let row = || (f64::NAN, vec![0.0; width]);
        let grid = |step| Grid { step, start: f64::NAN, next: 0, before: row(), after: row(), line: 0 };
        Self { rows, grid: resample.map(grid) }
    }

    /// The next row; `None` at the end.
    pub(crate) fn next(&mut self, values: &mut [f64]) -> Result<Option<Row>, InferError> {
        let Self { rows, grid } = self;
        match grid {
            Some(grid) => grid.next(rows, values),
            None => rows.next(values),
        }
    }

    /// A fault of this recording.
    pub(crate) fn fault(&self, line: Option<u64>, message: String, help: &str) -> InferError {
        self.rows.fault(line, message, help)
    }
}

impl Grid {
    fn next<R: Read>(&mut self, rows: &mut Rows<R>, values: &mut [f64]) -> Result<Option<Row>, InferError> {
        let mut time = self.start + self.next as f64 * self.step;
        while self.after.0.is_nan() || self.after.0 < time - SAME * self.step {
            std::mem::swap(&mut self.before, &mut self.after);
            let Some(row) = rows.next(&mut self.after.1)? else {
                // Another call finds the end again.
                std::mem::swap(&mut self.before, &mut self.after);
                return Ok(None);
            };
            (self.after.0, self.line) = (row.time, row.line);
            let before = self.before.0;
            if row.time <= before {
                let message = format!("time {} is not later than {before} in the row before", row.time);
                return Err(rows.fault(Some(row.line), message, "keep one row per time, in their order"));
            }
            if before.is_nan() || row.time - before > GAP * self.step {
                // A piece begins, and its first row is its first time.
                (self.start, self.next, time) = (row.time, 0, row.time);
            }
        }
        let ((from, a), (to, b)) = (&self.before, &self.after);
        let part = if self.next == 0 { 1.0 } else { ((time - from) / (to - from)).min(1.0) };
        for ((value, a), b) in values.iter_mut().zip(a).zip(b) {
            *value = if part < 1.0 { a + part * (b - a) } else { *b };
        }
        self.next += 1;
        Ok(Some(Row { line: self.line, time, byte: 0 }))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn resampled(text: &str, step: f64) -> Result<Vec<(f64, f64)>, InferError> {
        let rows = Rows::new(Path::new("data.csv"), text.as_bytes(), "t", &["x".to_owned()])?;
        let mut feed = Feed::new(rows, Some(step), 1);
        let (mut found, mut value) = (Vec::new(), [0.0]);
        while let Some(row) = feed.next(&mut value)? {
            found.push((row.time, value[0]));
        }
        Ok(found)
    }

    #[test]
    fn rows_are_linear_between_neighbours_and_stay_where_they_stand() {
        let found = resampled("t,x\n1,0\n1.25,1\n2,4\n2.5,3\n3.25,6\n", 0.5).unwrap_or_default();
        assert_eq!(found, [(1.0, 0.0), (1.5, 2.0), (2.0, 4.0), (2.5, 3.0), (3.0, 5.0)]);
    }

    #[test]
    fn a_gap_of_more_than_two_steps_begins_a_piece_with_its_first_row() {
        let found = resampled("t,x\n0,0\n1,1\n3.25,9\n4.5,4\n", 1.0).unwrap_or_default();
        assert_eq!(found, [(0.0, 0.0), (1.0, 1.0), (3.25, 9.0), (4.25, 5.0)]);
    }

    #[test]
    fn a_row_that_repeats_is_told_with_its_line() {
        let error =
            resampled("t,x\n1,0\n2,1\n2,1\n", 1.0).map_or_else(|error| error.to_string(), |_| String::new());
        assert!(error.contains("data.csv:4") && error.contains("not later than"), "{error}");
    }
}
