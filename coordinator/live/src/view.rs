//! What is shown of a run at one moment, as plain data: the page, its stream and `starlings watch` share it.
//!
//! Next file to read: [`super::told`].

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

/// What does not change while a command runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Head {
    /// Name of the study.
    pub study: String,
    /// The command, such as `run`.
    pub command: String,
    /// Kind of the model.
    pub model: String,
    /// Version of the program.
    pub version: String,
    /// Names and units of the estimated parameters.
    pub units: Vec<(String, String)>,
}

/// Whether it still runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// It runs.
    #[default]
    Running,
    /// It is done.
    Finished,
    /// It ended before it was done.
    Ended,
}

/// What the work is counted in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Counted {
    /// Runs of the model.
    #[default]
    Runs,
    /// Blocks of a recording.
    Blocks,
}

impl fmt::Display for Counted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Runs => "runs",
            Self::Blocks => "blocks",
        })
    }
}

/// How far the work is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// What is being done, such as `pass 2`.
    pub stage: String,
    /// More of it, such as `10 of 40 analyses`.
    pub says: String,
    /// Share of the work that is done, from 0 to 1, where that is known.
    pub share: Option<f64>,
    /// Time left, s, where it can be said.
    pub left_s: Option<f64>,
    /// How many of what is counted are done.
    pub runs: u64,
    /// What is counted.
    pub counted: Counted,
    /// Workers.
    pub workers: usize,
}

/// Slots and runs of a fleet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FleetView {
    /// Connected workers.
    pub workers: usize,
    /// Those of them that are given no runs for a while.
    pub aside: usize,
    /// Slots of all workers.
    pub slots: usize,
    /// Slots with a run.
    pub busy: usize,
    /// Runs that no worker has.
    pub queued: usize,
    /// Runs that wait at a worker for a slot.
    pub ahead: usize,
    /// Runs of the batch without an outcome.
    pub open: usize,
    /// Runs that ended in a prediction.
    pub predictions: u64,
    /// Connections of workers that ended before the command did.
    pub losses: u64,
}

/// One worker.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorkerView {
    /// Its name in the run.
    pub name: String,
    /// Runs that it makes at the same time.
    pub slots: usize,
    /// Runs that it was given and has not answered.
    pub jobs: usize,
    /// `working`, `idle`, `set aside` or `lost`.
    pub state: String,
    /// Why, where it is set aside or lost.
    pub why: String,
    /// When it was lost, s since the command began.
    pub at_s: Option<f64>,
}

/// A parameter as the last analysis left it, physical units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterView {
    /// Its name in the estimated vector.
    pub name: String,
    /// Median.
    #[serde(deserialize_with = "or_nan")]
    pub estimate: f64,
    /// Estimate − 2 sd, taken in transformed units.
    #[serde(deserialize_with = "or_nan")]
    pub lo: f64,
    /// Estimate + 2 sd, taken in transformed units.
    #[serde(deserialize_with = "or_nan")]
    pub hi: f64,
}

/// A number that JSON has as null where it is none.
fn or_nan<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(from)?.unwrap_or(f64::NAN))
}

/// A stage of a command's work, where it has them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageView {
    /// Its name.
    pub name: String,
    /// What it said last.
    pub says: String,
    /// When it began, s since the command began.
    pub from_s: f64,
    /// Runs at its beginning.
    pub runs: u64,
}

/// Something that happened.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EventView {
    /// When, s since the command began.
    pub at_s: f64,
    /// Its kind.
    pub kind: String,
    /// In words.
    pub text: String,
}

/// All of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// What does not change.
    pub head: Head,
    /// Whether it still runs.
    pub state: State,
    /// Why it ended, where it did before it was done.
    pub ended: String,
    /// Whether the page can lead to a report.
    pub report: bool,
    /// Wall time, s.
    pub elapsed_s: f64,
    /// How far it is.
    pub standing: Standing,
    /// The fleet; `None` once it is closed.
    pub fleet: Option<FleetView>,
    /// Its workers: first those that were lost last, then in the order in which they came.
    pub workers: Vec<WorkerView>,
    /// Workers that are not in the list.
    pub workers_left_out: usize,
    /// Runs that ended in no prediction, by the type of their failure.
    pub failures: Vec<(String, u64)>,
    /// Analyses in the store.
    pub analyses: u64,
    /// Pass and step of the last analysis, from 1.
    pub at: Option<(u64, u64)>,
    /// Normalised innovation squared of the last analysis, and the observations in it.
    pub nis: Option<(f64, u64)>,
    /// Parameters after the last analysis.
    pub parameters: Vec<ParameterView>,
    /// The stages so far.
    pub stages: Vec<StageView>,
    /// What happened last, the latest first.
    pub events: Vec<EventView>,
    /// What of the store cannot be read.
    pub unreadable: Option<String>,
}
