//! First versions of studies: of a recording, of a model, or of both.
//!
//! What a file or a model says of itself is taken from there; what nobody can know is asked, by a function of the caller, and has a
//! default or an option. The study that is written was loaded and run once. Next files to read: [`sheet`] for what a table may look
//! like, [`roles`] for which column is what, [`write`] for the folder.

mod cells;
mod equations;
mod header;
mod model;
mod moment;
mod parts;
mod predicted;
mod prior;
mod recording;
mod roles;
mod row_numbers;
mod separator;
mod sheet;
mod text;
mod times;
mod unknowns;
mod write;

use std::path::{Path, PathBuf};

use starlings_models::SolverDef;
use starlings_study::SolverHost;

use crate::{Draft, DraftError};

/// What is known of the study that is wanted.
#[derive(Clone, Debug, Default)]
pub struct Wishes {
    /// Tables with what was measured, one record each.
    pub recordings: Vec<PathBuf>,
    /// The model; without one a first-order response of every column is written.
    pub model: Option<ModelWish>,
    /// Column of the times, by its name or heading.
    pub time: Option<String>,
    /// Time between two rows, in a file without times.
    pub step: Option<f64>,
    /// Unit of the times, where the file does not say it.
    pub time_unit: Option<String>,
    /// Columns that drive the model, each with the model's name where it is another.
    pub inputs: Vec<(String, Option<String>)>,
    /// Columns that were measured, likewise.
    pub outputs: Vec<(String, Option<String>)>,
    /// Standard deviations of the errors by column.
    pub noise: Vec<(String, f64)>,
    /// Parameters that are unknown.
    pub unknown: Vec<String>,
    /// Times of predictions that stand for a recording where there is none.
    pub times: Vec<f64>,
}

/// A model that somebody has.
#[derive(Clone, Debug)]
pub enum ModelWish {
    /// A kind of built-in models.
    Kind(String),
    /// A file with the layout of a model, such as a netlist; its kind where it is not plain.
    Layout(PathBuf, Option<String>),
    /// A program that describes itself, as it is started in the current folder.
    Solver(Box<SolverDef>),
    /// A functional mock-up unit, which is copied into the study's folder.
    Fmu(PathBuf),
}

/// Something that only the user knows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Question {
    /// A sentence with a question mark.
    pub text: String,
    /// Answers that are possible; empty where any is.
    pub choices: Vec<String>,
    /// What is taken without an answer; where there is none, the study cannot be written.
    pub default: Option<String>,
    /// The option by which a command is told the same.
    pub option: String,
}

impl Question {
    fn unanswered(&self, why: &str) -> String {
        let choices =
            if self.choices.is_empty() { String::new() } else { format!(" ({})", self.choices.join(", ")) };
        format!("{why}{choices}: say it by {}", self.option)
    }
}

/// Answers questions; `None` where nobody can.
pub type Ask<'a> = &'a mut dyn FnMut(&Question) -> Option<String>;

/// Writes a study into a new folder.
///
/// # Errors
/// When a file or a model cannot be read, something is not known that has no default, the folder is there already, or the study does
/// not run.
pub fn init(wishes: &Wishes, out: &Path, host: &SolverHost, ask: Ask<'_>) -> Result<Draft, DraftError> {
    if out.exists() {
        return Err(DraftError::Taken(out.to_owned()));
    }
    let model = model::model(wishes, out, host, ask)?;
    let time = times::TimeWish { column: wishes.time.as_deref(), step: wishes.step };
    let mut recordings = Vec::new();
    for file in &wishes.recordings {
        let found = recording::recording(file, &time, ask);
        recordings.push(found.map_err(|message| DraftError::file(file, message))?);
    }
    let refuse = |message: String| DraftError::Wish(message);
    let study = match recordings.first() {
        Some(first) => {
            let roles = roles::roles(model.spec.as_ref(), first, wishes, ask).map_err(refuse)?;
            parts::Parts::measured(wishes, model, recordings, &roles, ask).map_err(refuse)?
        }
        None => parts::Parts::predicted(wishes, model).map_err(refuse)?,
    };
    write::write(study, out, host)
}
