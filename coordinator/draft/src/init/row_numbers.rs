//! Columns that number the rows of a table and measure nothing.
//!
//! Next file to read: [`super::recording`].

use super::cells::number;
use super::sheet::Sheet;

/// Headings under which tables of R and pandas number their rows.
const ROW_NUMBERS: [&str; 5] = ["", "rownames", "row", "index", "Unnamed: 0"];

/// Whether a column does nothing but number the rows, as tables of R and pandas are written.
pub(super) fn numbers_rows(sheet: &Sheet, at: usize) -> bool {
    let heading = sheet.headers[at].trim();
    // R makes an X of a heading that is missing; a small one is a place.
    let is_named = heading == "X" || ROW_NUMBERS.iter().any(|known| heading.eq_ignore_ascii_case(known));
    let cells = || sheet.rows.iter().map(|row| number(&row[at]));
    let start = cells().next().flatten().filter(|start| [0.0, 1.0].contains(start));
    is_named
        && start.is_some_and(|start| cells().enumerate().all(|(row, cell)| cell == Some(start + row as f64)))
}
