//! Where a run stands, as it is told and as the store keeps it.
//!
//! Next file to read: [`crate::work`], how much there is to do.

use serde::Serialize;

use crate::store::json::json;
use crate::store::{Store, StoreError};
use crate::work::Work;

/// Where a run stands.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Progress {
    /// `filter`, `batch`, or one of [`LAST`].
    pub stage: &'static str,
    /// Pass, from 1.
    pub pass: usize,
    /// Passes in all; `None` when they go on until the estimate has settled.
    pub passes: Option<usize>,
    /// Analyses done in this pass.
    pub step: usize,
    /// Analyses of a pass, at most.
    pub steps: usize,
    /// Runs so far.
    pub runs: u64,
    /// Workers now.
    pub workers: usize,
    /// How much of the work is done.
    pub work: Work,
}

/// Where a command stands whose work has stages and no passes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stage {
    /// What is being done, in a word.
    pub name: &'static str,
    /// More of it, in a few words; empty where the stage goes on.
    pub says: String,
    /// Runs so far.
    pub runs: u64,
    /// Workers now.
    pub workers: usize,
    /// How much of the work is done, of all stages together.
    pub work: Work,
}

impl Stage {
    /// Keeps it in the store, as [`Progress::note`].
    ///
    /// # Errors
    /// When the store cannot be written.
    pub fn note(&self, store: &Store) -> Result<(), StoreError> {
        store.set_meta(PROGRESS, &json(self))
    }
}

/// Name under which the store keeps the last [`Progress`] or [`Stage`], as JSON.
pub const PROGRESS: &str = "progress";

/// The runs after a fit, in their order: with the estimate, with the observer, with constants moved, beside the estimate, with draws of
/// the posterior; then what the coordinator does alone.
pub const LAST: [&str; 6] = ["final run", "observer", "constants", "residuals", "predictions", FILES];

/// A stage of a run, in a word or two: a pass where there are several or nobody knows how many.
pub fn title(stage: &str, pass: usize, passes: Option<usize>) -> String {
    match passes {
        _ if LAST.contains(&stage) => stage.to_owned(),
        None => format!("pass {pass}"),
        Some(passes) if passes > 1 => format!("pass {pass}/{passes}"),
        Some(_) => stage.to_owned(),
    }
}

/// How far a stage of a run is, in a few words.
pub fn says(stage: &str, step: usize, steps: usize) -> String {
    match stage {
        FILES => String::new(),
        _ if LAST.contains(&stage) => format!("{step} of {steps} ensembles after the fit"),
        _ => format!("{step} of {steps} analyses"),
    }
}

/// After all runs: the summary and the files.
pub const FILES: &str = "files";

impl Progress {
    /// Whether it tells of an analysis, and not of the beginning of a pass or what comes after the last one.
    pub fn is_analysis(&self) -> bool {
        self.step > 0 && !self.is_after_fit()
    }

    /// Whether the fit is over.
    pub fn is_after_fit(&self) -> bool {
        LAST.contains(&self.stage)
    }

    /// Its stage, in a word or two.
    pub fn title(&self) -> String {
        title(self.stage, self.pass, self.passes)
    }

    /// How far its stage is, in a few words.
    pub fn says(&self) -> String {
        says(self.stage, self.step, self.steps)
    }

    /// Keeps it in the store, for those who look at the run from outside.
    pub(crate) fn note(&self, store: &Store) -> Result<(), StoreError> {
        store.set_meta(PROGRESS, &json(self))
    }
}
