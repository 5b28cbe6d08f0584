//! The cells of a table of correlations, as two pages show them. Next file to read: [`super::number`].

use serde::Serialize;

use super::number;

/// Rows and columns of a table at most.
pub(crate) const MOST: usize = 24;

/// One cell: its text and the share of colour behind it.
#[derive(Debug, Serialize)]
pub(crate) struct Cell {
    text: String,
    class: &'static str,
    share: String,
}

/// The cells of a row whose number is `diagonal`; what is not a number is not known.
pub(crate) fn row(diagonal: usize, values: &[f64]) -> Vec<Cell> {
    let cell = |(k, &value): (usize, &f64)| Cell {
        text: number::with_sd(value, 0.1),
        class: if k == diagonal {
            "diagonal"
        } else if value < 0.0 {
            "negative"
        } else {
            "positive"
        },
        share: format!("{:.0}%", if value.is_finite() { 60.0 * value.abs().min(1.0) } else { 0.0 }),
    };
    values.iter().enumerate().map(cell).collect()
}
