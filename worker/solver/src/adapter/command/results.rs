//! The outputs of a run out of what the program wrote.
//!
//! Next file to read: [`super::rule`], then [`super::json`] and [`super::table`].

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

use starlings_models::nearest;

use super::fault::{Fault, shape};
use super::json;
use super::program::{LIMIT, Output};
use super::rule::{Rule, STANDARD_OUTPUT};
use super::table::{Table, number, plain_column};

/// What a message calls the standard output.
const SPOKEN: &str = "the standard output";

/// What a program wrote; every file is read once.
pub(super) struct RunResults<'a> {
    folder: &'a Path,
    output: &'a Output,
    read: RefCell<BTreeMap<String, Rc<str>>>,
}

impl<'a> RunResults<'a> {
    pub(super) fn new(folder: &'a Path, output: &'a Output) -> Self {
        Self { folder, output, read: RefCell::default() }
    }

    /// The values of an output of `size` components, one time after the other.
    ///
    /// # Errors
    /// When there are none, or of another number than belongs.
    pub(super) fn values(&self, rule: &Rule, size: usize, times: &[f64]) -> Result<Vec<f64>, Fault> {
        let text = self.text(rule.file())?;
        let file = if rule.file() == STANDARD_OUTPUT { SPOKEN } else { rule.file() };
        let counted = |values: Vec<f64>| {
            let expected = size * times.len();
            if values.len() == expected {
                return Ok(values);
            }
            let shape = shape(size, times.len());
            Err(Fault::Length { file: file.to_owned(), expected, got: values.len(), shape })
        };
        match rule {
            Rule::Json { keys, .. } => {
                let document = json::document(&text);
                let document = document.map_err(|error| Fault::NotJson {
                    file: file.to_owned(),
                    reason: if text.trim().is_empty() { "it is empty".to_owned() } else { error.to_string() },
                })?;
                json::numbers(json::at(&document, keys, file)?, size, times.len(), file)
            }
            Rule::Csv { column, time, .. } => {
                Table::read(&text, file)?.output(column, time.as_deref(), size, times)
            }
            Rule::Regex { pattern, .. } => {
                let groups = pattern.captures_iter(&text).filter_map(|found| found.get(1));
                let one = |group: regex::Match<'_>| {
                    number(group.as_str()).ok_or_else(|| Fault::NotNumber {
                        file: file.to_owned(),
                        place: format!("line {}", text[..group.start()].matches('\n').count() + 1),
                        text: group.as_str().chars().take(40).collect(),
                    })
                };
                counted(groups.map(one).collect::<Result<_, _>>()?)
            }
            Rule::Column { number, .. } => counted(plain_column(&text, *number)),
        }
    }

    fn text(&self, file: &str) -> Result<Rc<str>, Fault> {
        if let Some(text) = self.read.borrow().get(file) {
            return Ok(Rc::clone(text));
        }
        let text: Rc<str> = if file == STANDARD_OUTPUT {
            if self.output.cut {
                return Err(Fault::TooLong { file: SPOKEN.to_owned(), limit: LIMIT / (1024 * 1024) });
            }
            String::from_utf8_lossy(&self.output.bytes).into()
        } else {
            let bytes = std::fs::read(self.folder.join(file)).map_err(|error| self.unread(file, &error))?;
            String::from_utf8_lossy(&bytes).into()
        };
        self.read.borrow_mut().insert(file.to_owned(), Rc::clone(&text));
        Ok(text)
    }

    fn unread(&self, file: &str, error: &std::io::Error) -> Fault {
        if error.kind() != std::io::ErrorKind::NotFound {
            return Fault::Unreadable { file: file.to_owned(), reason: error.to_string() };
        }
        let entries = std::fs::read_dir(self.folder).into_iter().flatten().flatten();
        let mut known: Vec<String> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        known.sort();
        Fault::NoFile { file: file.to_owned(), nearest: nearest(file, &known), known }
    }
}
