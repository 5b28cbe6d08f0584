//! Runs that workers brought along and no job needs yet.
//!
//! Next file to read: [`super::held`], which matches them with jobs.

use std::collections::HashMap;

use starlings_proto::{Bytes, JobKey};

use crate::dispatcher::WorkerId;

/// Bytes of results that wait for a batch at most.
const MOST: usize = 256 * 1024 * 1024;

/// Runs that wait for the batch that needs them.
#[derive(Default)]
pub(super) struct Waiting {
    pub(super) runs: HashMap<JobKey, Run>,
    bytes: usize,
    /// The jobs of the running batch by their keys, once a worker brought something along.
    pub(super) places: Option<HashMap<JobKey, usize>>,
}

/// A run that a worker brought along.
pub(super) struct Run {
    pub(super) worker: WorkerId,
    pub(super) ended: Option<Bytes>,
    /// Batches that did not need it.
    pub(super) passed: u32,
}

impl Waiting {
    pub(super) fn put(&mut self, key: JobKey, run: Run) {
        let bytes = run.ended.as_ref().map_or(0, Bytes::len);
        if self.bytes + bytes > MOST {
            return;
        }
        self.bytes += bytes;
        if let Some(old) = self.runs.insert(key, run) {
            self.bytes -= old.ended.map_or(0, |ended| ended.len());
        }
    }

    /// What a worker still made is lost with it; what it had finished is not.
    pub(super) fn left(&mut self, worker: WorkerId) {
        self.runs.retain(|_, run| run.worker != worker || run.ended.is_some());
    }

    pub(super) fn take_all(&mut self) -> HashMap<JobKey, Run> {
        self.bytes = 0;
        std::mem::take(&mut self.runs)
    }
}
