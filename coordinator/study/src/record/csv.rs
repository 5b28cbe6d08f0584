//! A CSV recording: a header line, one row per time, numbers or empty cells.
//!
//! Every complaint names the line and the column. Next file to read: [`crate::record`].

use starlings_models::{did_you_mean, nearest, quoted_list};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::separator::Foreign;
use crate::file::locate::{csv_field, line_column};
use crate::problem::{Problem, Source, StudyError};

/// Where a row begins.
#[derive(Debug)]
struct Row {
    /// Byte of the file's text.
    start: usize,
    /// Number of cells before it.
    first: usize,
}

/// The text of a recording, cut into rows and columns.
#[derive(Debug)]
pub(crate) struct Csv {
    pub(crate) path: PathBuf,
    source: Source,
    pub(crate) headers: Vec<String>,
    rows: Vec<Row>,
    /// The texts of all cells, one after the other: a text of its own for every cell would take several times the file.
    cells: String,
    /// Where each of them ends there.
    ends: Vec<usize>,
}

impl Csv {
    /// Cuts a text into rows.
    ///
    /// # Errors
    /// When it has no header, no row, or a row of another length than the header.
    pub(crate) fn new(path: &Path, text: String) -> Result<Self, StudyError> {
        let bare = text.strip_prefix('\u{feff}').unwrap_or(&text);
        refuse_foreign(path, bare)?;
        let source = Source::new(path, bare);
        drop(text);
        let text = Arc::clone(&source.text);
        let n_line = text.bytes().filter(|b| *b == b'\n').count() + 1;
        let mut csv = Self {
            path: path.to_owned(),
            source,
            headers: Vec::new(),
            rows: Vec::with_capacity(n_line),
            cells: String::with_capacity(text.len()),
            ends: Vec::new(),
        };
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut row = csv::StringRecord::new();
        loop {
            match reader.read_record(&mut row) {
                Ok(false) => break,
                Ok(true) if csv.headers.is_empty() => {
                    csv.headers = row.iter().map(ToOwned::to_owned).collect();
                    csv.ends.reserve(n_line * csv.headers.len());
                }
                Ok(true) => csv.add(&row),
                Err(error) => csv.source.report(0..0, format!("this is not CSV: {error}")),
            }
        }
        csv.check_shape();
        csv.source.verdict()?;
        Ok(csv)
    }

    fn add(&mut self, row: &csv::StringRecord) {
        // The reader's position may stand before blank lines.
        let from = row.position().map_or(0, |p| p.byte() as usize);
        let blank =
            self.source.text.as_bytes()[from..].iter().take_while(|b| matches!(b, b'\n' | b'\r')).count();
        self.rows.push(Row { start: from + blank, first: self.ends.len() });
        for cell in row {
            self.cells.push_str(cell);
            self.ends.push(self.cells.len());
        }
    }

    /// Number of cells of a row.
    fn width(&self, row: usize) -> usize {
        self.rows.get(row + 1).map_or(self.ends.len(), |next| next.first) - self.rows[row].first
    }

    /// The text of a cell, without the spaces and quotes around it.
    fn text(&self, row: usize, column: usize) -> &str {
        let cell = self.rows[row].first + column;
        let from = if cell == 0 { 0 } else { self.ends[cell - 1] };
        &self.cells[from..self.ends[cell]]
    }

    fn texts_of(&self, row: usize) -> impl Iterator<Item = &str> {
        (0..self.width(row)).map(move |column| self.text(row, column))
    }

    fn check_shape(&self) {
        let end = self.source.text.len();
        if self.headers.is_empty() {
            self.source.report(end..end, "the file is empty: expected a header line and one row per time");
        } else if self.rows.is_empty() {
            self.source.report(end..end, "the file has a header and no row");
        }
        let wanted = self.headers.len();
        if let Some(row) = (0..self.rows.len()).find(|row| self.width(*row) != wanted) {
            let n = self.width(row);
            let message = format!("this row has {n} cells, the header has {wanted}");
            self.source.report_with(self.cell(row, 0), message, self.row_help(row));
        }
    }

    /// The likely reason why a row has another number of cells than the header.
    fn row_help(&self, row: usize) -> String {
        let (width, wanted) = (self.width(row), self.headers.len());
        let whole = |cell: &str| cell.parse::<i64>().is_ok();
        if row == 0 && wanted == 1 && width > 1 {
            let first = &self.headers[0];
            return format!(
                "the first line must name the columns: remove `{first}` and other lines above the names"
            );
        }
        if width == wanted + 1 && self.text(row, wanted).is_empty() {
            return "it ends with a comma that the header has not".to_owned();
        }
        if width == 2 * wanted && self.texts_of(row).all(whole) {
            return "are these decimal commas? write the numbers with points: `0.5`, not `0,5`".to_owned();
        }
        "leave a missing value empty between its commas".to_owned()
    }

    /// Position of a column, or what is wrong with its name and the remedy.
    pub(crate) fn index(&self, column: &str) -> Result<usize, (String, String)> {
        let found: Vec<usize> = (0..self.headers.len()).filter(|i| self.headers[*i] == column).collect();
        match found[..] {
            [one] => Ok(one),
            [] => {
                let message = format!("`{}` has no column `{column}`", self.path.display());
                let numbers = self.headers.iter().all(|h| h.parse::<f64>().is_ok());
                let help = match self.headers.as_slice() {
                    [first, ..] if numbers => format!(
                        "its first line holds numbers (`{first}`): put a line with the names of the columns above it, such as \
                         `time,{column}`"
                    ),
                    _ => self.columns_help(column),
                };
                Err((message, help))
            }
            _ => {
                let message =
                    format!("`{}` has {} columns named `{column}`", self.path.display(), found.len());
                Err((message, "rename all but one".to_owned()))
            }
        }
    }

    fn columns_help(&self, column: &str) -> String {
        let list = format!("its columns are {}", quoted_list(&self.headers));
        match nearest(column, &self.headers) {
            Some(near) => format!("{} {list}", did_you_mean(near)),
            None => list,
        }
    }

    /// The numbers of a column; an empty cell or `NaN` is NaN.
    ///
    /// # Errors
    /// When a cell is neither; the first such cell, with the count of the others.
    pub(crate) fn numbers(&self, column: usize) -> Result<Vec<f64>, Problem> {
        let mut numbers = Vec::with_capacity(self.rows.len());
        let mut wrong = Vec::new();
        for (row, cell) in self.texts(column).enumerate() {
            match parse(cell) {
                Some(number) => numbers.push(number),
                None => wrong.push(row),
            }
        }
        let Some(&row) = wrong.first() else { return Ok(numbers) };
        let more = match wrong.len() {
            1 => String::new(),
            2 => ", nor is one other cell of this column".to_owned(),
            n => format!(", nor are {} other cells of this column", n - 1),
        };
        let name = &self.headers[column];
        let message = format!("`{}` in column `{name}` is not a finite number{more}", self.text(row, column));
        Err(self.problem(row, column, message, self.cell_help(row, column)))
    }

    /// What to do about a cell that is no number.
    fn cell_help(&self, row: usize, column: usize) -> &'static str {
        let cell = self.text(row, column);
        if row == 0 && self.texts_of(row).all(|c| parse(c).is_none_or(f64::is_nan)) {
            return "the second line holds no number: remove it where it names units, which belong into the study";
        }
        if cell.contains(':') || cell.matches(['-', '/']).count() == 2 {
            return "a time is a number, such as seconds since the start, in the study's time unit";
        }
        "write a number with a decimal point; leave a missing value empty"
    }

    /// The texts of a column.
    pub(crate) fn texts(&self, column: usize) -> impl Iterator<Item = &str> {
        (0..self.rows.len()).map(move |row| self.text(row, column))
    }

    /// The numbers of a time column, strictly increasing.
    ///
    /// # Errors
    /// When a time is missing, no number, repeated, or earlier than the one before it.
    pub(crate) fn times(&self, column: usize) -> Result<Vec<f64>, Problem> {
        let times = self.numbers(column)?;
        if let Some(row) = times.iter().position(|t| t.is_nan()) {
            let message = format!("the time in column `{}` is missing", self.headers[column]);
            return Err(self.problem(row, column, message, "every row needs its time"));
        }
        let Some(before) = times.windows(2).position(|w| w[1] <= w[0]) else { return Ok(times) };
        let row = before + 1;
        let (a, b) = (times[before], times[row]);
        let (line_a, line_b) = (self.line(before), self.line(row));
        let (message, help) = if b < a {
            (
                format!("time goes back from {a} (line {line_a}) to {b} (line {line_b})"),
                "times must increase from row to row: sort the rows, or split the file into records",
            )
        } else {
            (
                format!("duplicate time {b} on lines {line_a} and {line_b}"),
                "times must increase from row to row: keep one of the rows, or average them",
            )
        };
        Err(self.problem(row, column, message, help))
    }

    /// Line of a row, from 1, the header included.
    pub(crate) fn line(&self, row: usize) -> usize {
        line_column(&self.source.text, self.rows[row].start).0
    }

    /// A problem at one cell.
    pub(crate) fn problem(&self, row: usize, column: usize, message: String, help: &str) -> Problem {
        Problem {
            message,
            help: Some(help.to_owned()),
            file: self.path.clone(),
            source_text: Some(self.source.text.clone()),
            span: Some(self.cell(row, column)),
        }
    }

    fn cell(&self, row: usize, column: usize) -> Range<usize> {
        csv_field(&self.source.text, self.rows[row].start, column)
    }
}

/// Refuses other separators than commas, before every row is reported to have too few cells.
fn refuse_foreign(path: &Path, text: &str) -> Result<(), StudyError> {
    let Some(foreign) = Foreign::of(text) else { return Ok(()) };
    let source = Source::new(path, text);
    let start = text.len() - text.trim_start().len();
    let end = start + text[start..].lines().next().map_or(0, str::len);
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let message = format!("the columns of `{file}` are separated by {}, not by commas", foreign.separator);
    source.report_with(start..end, message, foreign.help());
    source.verdict()
}

/// A finite number; NaN for an empty cell; `None` for anything else.
fn parse(cell: &str) -> Option<f64> {
    if cell.is_empty() {
        return Some(f64::NAN);
    }
    cell.parse().ok().filter(|v: &f64| !v.is_infinite())
}
