//! Why a run stands where it does, in a sentence or three, from its store alone.
//!
//! A question is about the run, a parameter, a worker, a particle or an observation; names decide which. Nothing is computed beyond
//! counts and shares of what is stored. Next files to read: [`parameter`], [`observation`], [`fleet`].

mod fleet;
mod observation;
mod parameter;
#[cfg(test)]
mod tests;

use serde::Serialize;
use starlings_study::RunFolder;
use starlings_study::store::{Purpose, Store, StoreError};

use crate::number;

/// An answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Answer {
    /// What it is about: `run`, `parameter R`, `worker 1@host/7`, `particle 3`, `observation pressure at 1.5`.
    pub about: String,
    /// The answer, a sentence each.
    pub says: Vec<String>,
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum WhyError {
    /// The folder is of another command.
    #[error(
        "{0} is the folder of an explanation: why speaks of runs; the report of an explanation says why it names what it names"
    )]
    Explanation(String),
    /// Nothing in the run has this name.
    #[error(
        "nothing in this run is called `{asked}`; it has the parameters {parameters}; the outputs {outputs}; the workers {workers}; the particles 0 to {last}"
    )]
    Unknown {
        /// What was asked.
        asked: String,
        /// Names of its parameters.
        parameters: String,
        /// Names of its outputs.
        outputs: String,
        /// Names of its workers.
        workers: String,
        /// Number of its last particle.
        last: u32,
    },
    /// The store failed or is damaged.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Answers the question about `subject`, or about the run.
///
/// # Errors
/// [`WhyError`] for a folder that is no run's, a name that nothing has, and a store that fails.
pub fn why(folder: &RunFolder, subject: Option<&str>) -> Result<Answer, WhyError> {
    let store = &folder.store;
    if folder.purpose()? == Purpose::Explanation {
        return Err(WhyError::Explanation(folder.path.display().to_string()));
    }
    let Some(subject) = subject else {
        return Ok(Answer { about: "run".to_owned(), says: fleet::run(folder)? });
    };
    let names = Names::read(store)?;
    let (output, time) =
        subject.rsplit_once('@').map_or((subject, None), |(o, t)| (o, t.parse::<f64>().ok()));
    let number = subject.parse::<u32>().ok().filter(|n| *n <= names.last);
    let (about, says) = if names.parameters.iter().any(|name| name == subject) {
        (format!("parameter {subject}"), parameter::why(store, subject)?)
    } else if names.workers.iter().any(|name| name == subject) {
        (format!("worker {subject}"), fleet::worker(store, subject)?)
    } else if names.outputs.iter().any(|name| name == output) && (time.is_some() || subject == output) {
        observation::why(store, output, time)?
    } else if let Some(particle) = number {
        (format!("particle {particle}"), fleet::particle(store, particle)?)
    } else {
        return Err(names.without(subject));
    };
    Ok(Answer { about, says })
}

/// What a question may be about.
struct Names {
    parameters: Vec<String>,
    outputs: Vec<String>,
    workers: Vec<String>,
    last: u32,
}

impl Names {
    fn read(store: &Store) -> Result<Self, StoreError> {
        let texts = |sql: &str| store.rows(sql, |row| row.get::<_, String>(0));
        let last = store.rows("SELECT coalesce(max(particle), 0) FROM jobs", |row| row.get(0))?;
        Ok(Self {
            parameters: texts("SELECT DISTINCT parameter FROM estimates ORDER BY rowid")?,
            outputs: texts("SELECT output FROM innovations GROUP BY output ORDER BY min(rowid)")?,
            workers: texts("SELECT DISTINCT worker FROM jobs ORDER BY worker")?,
            last: last.first().copied().unwrap_or(0),
        })
    }

    fn without(&self, asked: &str) -> WhyError {
        // Names beyond a line help nobody.
        let listed = |names: &[String]| match names.len() {
            0 => "(none)".to_owned(),
            n if n > 12 => format!("{} and {} more", names[..12].join(", "), n - 12),
            _ => names.join(", "),
        };
        WhyError::Unknown {
            asked: asked.to_owned(),
            parameters: listed(&self.parameters),
            outputs: listed(&self.outputs),
            workers: listed(&self.workers),
            last: self.last,
        }
    }
}

/// A count with its noun.
fn count(n: u64, one: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {one}s") }
}

/// A number of four digits.
fn digits(value: f64) -> String {
    number::significant(value, 4)
}
