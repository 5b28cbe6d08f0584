//! How much a command has to do, by kinds of work, for whoever waits; no number of a result depends on it.
//!
//! Kinds are told apart because a unit of one takes another time than a unit of another, which is measured as the command goes on. Next
//! file to read: [`plan`], that of a run.

pub(crate) mod plan;
pub(crate) mod settling;

use serde::{Deserialize, Serialize};

/// What a unit of a kind of work takes, as far as that is known before one is done.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Takes {
    /// Of runs of the model: so many times what a unit of another kind with 1 takes.
    Runs(f64),
    /// Of what the coordinator does alone: seconds.
    Seconds(f64),
}

/// Work of one kind, in a unit of its own: simulated time times runs, runs, steps of a recording, the work once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// What a unit takes.
    pub takes: Takes,
    /// Units that are done.
    pub done: f64,
    /// Units that are left, as far as they can be foreseen.
    pub left: f64,
}

/// The work of a command.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// Its kinds, the same ones in the same order as long as the command goes on.
    pub parts: Vec<Part>,
    /// Place of the kind that is being done ...
    pub at: usize,
    /// ... and units of it in the next batch of runs.
    pub next: f64,
    /// Whether nothing is known to follow that is not in it, so that it tells when the command ends.
    pub ends: bool,
}

impl Work {
    /// Work of one kind, all of it `total`.
    pub fn of_runs(done: f64, next: f64, total: f64) -> Self {
        let part = Part { takes: Takes::Runs(1.0), done, left: (total - done).max(0.0) };
        Self { parts: vec![part], at: 0, next, ends: true }
    }

    /// The same once this share of the next batch is done.
    #[must_use]
    pub fn with_batch(&self, share: f64) -> Self {
        let mut later = self.clone();
        if let Some(part) = later.parts.get_mut(self.at) {
            part.done += share * self.next;
            part.left = (part.left - share * self.next).max(0.0);
        }
        later.next *= 1.0 - share;
        later
    }
}
