//! Why a solver cannot be used at all; a run that fails is a `ParticleError` instead.

/// Why a solver cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolverError {
    /// No adapter of that name.
    #[error("no adapter named `{name}`{}; there are {known}", starlings_models::meant(nearest.as_ref()))]
    Adapter {
        /// The name given.
        name: String,
        /// The nearest one, if close.
        nearest: Option<String>,
        /// All of them.
        known: String,
    },
    /// The study does not say what this adapter needs.
    #[error("{0}")]
    Incomplete(String),
    /// The program cannot be started.
    #[error("the solver `{program}` cannot be started: {reason}")]
    Start {
        /// The program.
        program: String,
        /// What the system says, with the remedy where one is known.
        reason: String,
    },
    /// The program ended, or was silent for too long, before it answered.
    #[error("the solver `{program}` {what}{}", tail_text(tail))]
    NotReady {
        /// The program.
        program: String,
        /// What happened, such as `exited with status 1 before it was ready`.
        what: String,
        /// The end of its output.
        tail: String,
        /// Whether it was killed from outside.
        killed: bool,
    },
    /// It speaks another protocol, or says something that makes no sense.
    #[error("the solver `{program}` describes itself wrongly: {message}")]
    Description {
        /// The program.
        program: String,
        /// What is wrong.
        message: String,
    },
}

impl SolverError {
    /// The last that a program said which ended before it was ready: what people look for first.
    pub fn last_words(&self) -> Option<String> {
        let Self::NotReady { what, tail, .. } = self else { return None };
        let ended = what.ends_with(" before it was ready");
        tail.lines().rev().map(str::trim).find(|line| !line.is_empty()).filter(|_| ended).map(str::to_owned)
    }

    /// Whether the program is not on this machine.
    pub fn is_absent(&self) -> bool {
        matches!(self, Self::Start { reason, .. } if reason == ABSENT)
    }
}

/// Why a program that is nowhere cannot be started.
pub(crate) const ABSENT: &str =
    "no such program, neither in the study's folder nor on the search path; check `command`";

/// The end of a program's output as the end of a sentence.
pub(crate) fn tail_text(tail: &str) -> String {
    if tail.is_empty() { String::new() } else { format!("; the end of its output:\n{tail}") }
}
