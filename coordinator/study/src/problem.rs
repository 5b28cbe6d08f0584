//! What is wrong with a study or its data: where, what was found, what was expected, and a remedy.
//!
//! The binary renders problems with source excerpts; here a problem is data with a one-line display. Next file to read:
//! [`super::file`].

use starlings_models::{did_you_mean, nearest, quoted_list};
use std::cell::RefCell;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::file::locate::line_column;

/// One thing wrong with a study file or one of its data files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// What was found, and what was expected.
    pub message: String,
    /// The remedy, such as the nearest valid name.
    pub help: Option<String>,
    /// The file that is wrong.
    pub file: PathBuf,
    /// Its text, when it could be read.
    pub source_text: Option<Arc<str>>,
    /// Bytes of the text that are wrong.
    pub span: Option<Range<usize>>,
}

impl Problem {
    /// Line and column of the span's start, both from 1; the column counts characters.
    pub fn line_column(&self) -> Option<(usize, usize)> {
        Some(line_column(self.source_text.as_deref()?, self.span.as_ref()?.start))
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.file.display())?;
        if let Some((line, column)) = self.line_column() {
            write!(f, "{line}:{column}:")?;
        }
        write!(f, " {}", self.message)?;
        if let Some(help) = &self.help {
            write!(f, " ({help})")?;
        }
        Ok(())
    }
}

/// Everything found wrong with a study, in the order of its file, then of its recordings; never empty.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct StudyError {
    /// The problems.
    pub problems: Vec<Problem>,
}

/// A text file and what was found wrong with it so far.
#[derive(Debug)]
pub(super) struct Source {
    pub(super) file: PathBuf,
    pub(super) text: Arc<str>,
    found: RefCell<Vec<Problem>>,
}

impl Source {
    pub(super) fn new(file: &Path, text: &str) -> Self {
        Self { file: file.to_owned(), text: Arc::from(text), found: RefCell::default() }
    }

    /// Reports a problem without a remedy.
    pub(super) fn report(&self, span: Range<usize>, message: impl Into<String>) {
        self.add(span, message.into(), None);
    }

    /// Reports a problem with its remedy.
    pub(super) fn report_with(
        &self,
        span: Range<usize>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        self.add(span, message.into(), Some(help.into()));
    }

    /// Reports a name that is not among the valid ones: names the nearest, or else lists them all.
    pub(super) fn report_unknown(&self, span: Range<usize>, message: impl Into<String>, valid: &[String]) {
        let name = self.text.get(span.clone()).unwrap_or_default().trim_matches(['"', '\'']).to_owned();
        self.add(span, message.into(), suggestion(&name, valid));
    }

    /// Adds a problem, perhaps of another file, unless it is known: several checks may find one cause.
    pub(super) fn adopt(&self, problem: Problem) {
        let mut found = self.found.borrow_mut();
        if !found.contains(&problem) {
            found.push(problem);
        }
    }

    /// Everything found so far as an error, if anything was.
    pub(super) fn verdict(&self) -> Result<(), StudyError> {
        let mut problems = self.found.borrow().clone();
        problems.sort_by_key(|p| (p.file != self.file, p.span.as_ref().map(|s| s.start)));
        if problems.is_empty() { Ok(()) } else { Err(StudyError { problems }) }
    }

    /// Number of problems so far.
    pub(super) fn count(&self) -> usize {
        self.found.borrow().len()
    }

    fn add(&self, span: Range<usize>, message: String, help: Option<String>) {
        let text = Some(Arc::clone(&self.text));
        self.adopt(Problem { message, help, file: self.file.clone(), source_text: text, span: Some(span) });
    }
}

/// `did you mean ...?` for a near miss, otherwise the list of what is valid.
pub(super) fn suggestion(name: &str, valid: &[String]) -> Option<String> {
    if let Some(near) = nearest(name, valid) {
        return Some(did_you_mean(near));
    }
    match valid {
        [] => None,
        [only] => Some(format!("the only valid name is `{only}`")),
        all => Some(format!("valid names: {}", quoted_list(all))),
    }
}
