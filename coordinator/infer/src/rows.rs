//! A recording, row by row: numbers of the named columns, with the line of what is wrong.
//!
//! One row is held at a time. Next file to read: `blocks.rs`.

use std::io::Read;
use std::path::{Path, PathBuf};

use starlings_models::{did_you_mean, nearest};

use crate::error::InferError;

/// Reads named columns of a CSV text.
pub(crate) struct Rows<R> {
    file: PathBuf,
    reader: csv::Reader<R>,
    record: csv::ByteRecord,
    /// Positions of the time and of every column.
    at: Vec<usize>,
    names: Vec<String>,
    n_cell: usize,
}

/// A row that was read.
pub(crate) struct Row {
    /// Line of the file, from 1.
    pub(crate) line: u64,
    /// Time.
    pub(crate) time: f64,
    /// Where it begins in the file; zero where it was interpolated.
    pub(crate) byte: u64,
}

impl<R: Read> Rows<R> {
    /// The rows of a text whose first line names its columns.
    pub(crate) fn new(file: &Path, text: R, time: &str, columns: &[String]) -> Result<Self, InferError> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
        let told = |line, message: String, help: &str| InferError::Recording {
            file: file.to_owned(),
            line,
            message,
            help: help.to_owned(),
        };
        let headers = reader.headers().map_err(|error| {
            told(Some(1), format!("this is not CSV: {error}"), "write numbers separated by commas")
        })?;
        let headers: Vec<String> =
            headers.iter().map(|h| h.trim_start_matches('\u{feff}').to_owned()).collect();
        if headers.iter().all(String::is_empty) {
            return Err(told(None, "the file is empty".to_owned(), "the first line names the columns"));
        }
        let names: Vec<String> = std::iter::once(time.to_owned()).chain(columns.iter().cloned()).collect();
        let find = |name: &String| {
            let message = || format!("there is no column `{name}`");
            headers.iter().position(|h| h == name).ok_or_else(|| {
                let help = match nearest(name, &headers) {
                    _ if headers.len() == 1 && headers[0].contains(['\t', ';']) => {
                        let sign = if headers[0].contains('\t') { "tabs" } else { "semicolons" };
                        format!(
                            "the columns are separated by {sign}, not by commas: `starlings init FILE` reads such a table and writes it \
                             with commas"
                        )
                    }
                    Some(near) => did_you_mean(near),
                    None => format!("the columns are {}", headers.join(", ")),
                };
                told(Some(1), message(), &help)
            })
        };
        let at = names.iter().map(find).collect::<Result<_, _>>()?;
        let (file, record, n_cell) = (file.to_owned(), csv::ByteRecord::new(), headers.len());
        Ok(Self { file, reader, record, at, names, n_cell })
    }

    /// Reads the next row into `values`, one per column; `None` at the end.
    pub(crate) fn next(&mut self, values: &mut [f64]) -> Result<Option<Row>, InferError> {
        match self.reader.read_byte_record(&mut self.record) {
            Ok(true) => {}
            Ok(false) => return Ok(None),
            Err(error) => {
                let line = error.position().map(csv::Position::line);
                let message = match error.kind() {
                    csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                        format!("this row has {len} cells, the header has {expected_len}")
                    }
                    _ => format!("this is not CSV: {error}"),
                };
                return Err(self.fault(line, message, "every row has a number for every column"));
            }
        }
        let (line, byte) = self.record.position().map_or((0, 0), |at| (at.line(), at.byte()));
        let time = self.number(line, 0)?;
        for (k, value) in values.iter_mut().enumerate() {
            *value = self.number(line, k + 1)?;
        }
        Ok(Some(Row { line, time, byte }))
    }

    fn number(&self, line: u64, k: usize) -> Result<f64, InferError> {
        let cell = self.record.get(self.at[k]).unwrap_or_default();
        let parsed = std::str::from_utf8(cell).ok().and_then(|text| text.parse::<f64>().ok());
        if let Some(value) = parsed.filter(|value| value.is_finite()) {
            return Ok(value);
        }
        let (name, text) = (&self.names[k], String::from_utf8_lossy(cell).into_owned());
        let message = if text.is_empty() || parsed.is_some_and(f64::is_nan) {
            format!("column `{name}` has no value")
        } else {
            format!("`{text}` in column `{name}` is not a finite number")
        };
        Err(self.fault(Some(line), message, "an inference needs every state at every time: remove what is before or after, or use gaps = \"break\" without this row"))
    }

    /// Cells of a row.
    pub(crate) fn n_cell(&self) -> usize {
        self.n_cell
    }

    /// Positions in a row of the time and of every column.
    pub(crate) fn cells(&self) -> &[usize] {
        &self.at
    }

    /// Bytes read so far.
    pub(crate) fn n_byte(&self) -> u64 {
        self.reader.position().byte()
    }

    /// The text.
    pub(crate) fn text(&self) -> &R {
        self.reader.get_ref()
    }

    /// A fault of this recording.
    pub(crate) fn fault(&self, line: Option<u64>, message: String, help: &str) -> InferError {
        InferError::Recording { file: self.file.clone(), line, message, help: help.to_owned() }
    }
}
