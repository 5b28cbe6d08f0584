//! One message with its cause and remedy, and the exit code that belongs to it.

use std::fmt::Display;
use std::process::ExitCode;

use miette::{Diagnostic, LabeledSpan, NamedSource, Report, Severity, SourceCode};
use serde_json::{Value, json};
use starlings_coordinator::study::{Problem, StudyError};

use crate::log;
use crate::note::{drawn, note, note_error};
use crate::plain::{Plain, of_same_length};

/// Why a command ended without doing what was asked.
pub(crate) enum Failure {
    /// The input is wrong: exit code 2.
    Input(String),
    /// The study file or a recording is wrong, at known places: exit code 2.
    Study(StudyError),
    /// The run failed: exit code 1.
    Run(String),
    /// A signal ended the work: exit code 130 for Ctrl-C.
    Interrupted {
        /// What became of the work, and how to go on.
        message: String,
        /// 128 and the number of the signal.
        code: u8,
    },
    /// The answer itself is that something does not hold, and was printed: exit code 1.
    Answered(String),
    /// Whoever read standard output has seen enough, as `head` does: nothing is wrong, exit code 0.
    Unread,
}

impl Failure {
    /// The input is wrong.
    pub(crate) fn input(message: impl Display) -> Self {
        Self::Input(message.to_string())
    }

    /// The run failed.
    pub(crate) fn run(message: impl Display) -> Self {
        Self::Run(message.to_string())
    }

    /// The same with an end to its message; a study's problems and a reader that left have none.
    pub(crate) fn with(self, end: &str) -> Self {
        match self {
            Self::Input(message) => Self::Input(message + end),
            Self::Run(message) => Self::Run(message + end),
            Self::Study(_) | Self::Answered(_) | Self::Interrupted { .. } | Self::Unread => self,
        }
    }

    /// Exit code.
    pub(crate) fn code(&self) -> ExitCode {
        match self {
            Self::Input(_) | Self::Study(_) => ExitCode::from(2),
            Self::Run(_) | Self::Answered(_) => ExitCode::from(1),
            Self::Interrupted { code, .. } => ExitCode::from(*code),
            Self::Unread => ExitCode::SUCCESS,
        }
    }

    /// The same for programs: `{ "error": ... }` with the message, and every problem of a study with its place. Nothing where
    /// standard output holds an answer already.
    pub(crate) fn as_json(&self) -> Option<Value> {
        match self {
            Self::Unread | Self::Answered(_) => None,
            Self::Input(message) | Self::Run(message) | Self::Interrupted { message, .. } => {
                Some(json!({ "error": message }))
            }
            Self::Study(error) => {
                let problems = error.problems.iter().map(|problem| {
                    let (line, column) = problem.line_column().unzip();
                    json!({
                        "file": problem.file, "line": line, "column": column, "message": problem.message, "help": problem.help,
                    })
                });
                Some(json!({ "error": error.to_string(), "problems": problems.collect::<Vec<_>>() }))
            }
        }
    }

    /// Prints the message to standard error.
    pub(crate) fn print(&self) {
        match self {
            Self::Unread => {}
            Self::Input(message)
            | Self::Run(message)
            | Self::Answered(message)
            | Self::Interrupted { message, .. } => {
                note_error(message);
            }
            Self::Study(error) if log::is_json() => {
                for problem in &error.problems {
                    let (line, column) = problem.line_column().unzip();
                    let (file, help) = (problem.file.display(), problem.help.as_deref());
                    tracing::error!(%file, line, column, help, "{}", problem.message);
                }
            }
            Self::Study(error) => {
                for problem in &error.problems {
                    drawn(format_args!("{:?}", Report::new(Shown::from(problem))));
                }
                let n = error.problems.len();
                if n > 1 {
                    note(format_args!("{n} problems; nothing was run"));
                }
            }
        }
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        Self::Study(error)
    }
}

/// A problem of the study as a diagnostic with its place in the file.
#[derive(Debug)]
struct Shown {
    message: String,
    help: Option<String>,
    source: Option<NamedSource<String>>,
    span: Option<std::ops::Range<usize>>,
}

impl From<&Problem> for Shown {
    fn from(problem: &Problem) -> Self {
        let source = problem
            .source_text
            .as_ref()
            .map(|text| NamedSource::new(Plain(problem.file.display()).to_string(), of_same_length(text)));
        let message = if source.is_some() && problem.span.is_some() {
            problem.message.clone()
        } else {
            format!("{}: {}", problem.file.display(), problem.message)
        };
        let plain = |text: &String| Plain(text).to_string();
        Self {
            message: plain(&message),
            help: problem.help.as_ref().map(plain),
            source,
            span: problem.span.clone(),
        }
    }
}

impl Display for Shown {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Shown {}

impl Diagnostic for Shown {
    fn severity(&self) -> Option<Severity> {
        Some(Severity::Error)
    }

    fn help<'a>(&'a self) -> Option<Box<dyn Display + 'a>> {
        self.help.as_ref().map(|h| Box::new(h) as Box<dyn Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|s| s as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.span.clone()?;
        self.source.as_ref()?;
        Some(Box::new(std::iter::once(LabeledSpan::new(
            Some("here".to_owned()),
            span.start,
            span.len().max(1),
        ))))
    }
}
