//! Runs that workers brought along and no job needs yet.
//!
//! Next file to read: [`super::held`], which matches them with jobs.

use std::collections::HashMap;

use starlings_proto::{Bytes, JobKey};

use crate::dispatcher::WorkerId;

/// Bytes of results that wait for a batch at most.
const MOST: usize = 256 * 1024 * 1024;

/// Runs that wait for the batch that needs them.
pub(super) struct Waiting {
    pub(super) runs: HashMap<JobKey, Run>,
    bytes: usize,
    /// The most that they may have.
    most: usize,
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

impl Default for Waiting {
    fn default() -> Self {
        Self { runs: HashMap::new(), bytes: 0, most: MOST, places: None }
    }
}

impl Waiting {
    pub(super) fn put(&mut self, key: JobKey, run: Run) {
        let bytes = run.bytes();
        if self.bytes + bytes > self.most {
            return;
        }
        self.bytes += bytes;
        if let Some(old) = self.runs.insert(key, run) {
            self.bytes -= old.bytes();
        }
    }

    /// What a worker still made is lost with it; what it had finished is not.
    pub(super) fn left(&mut self, worker: WorkerId) {
        self.runs.retain(|_, run| run.worker != worker || run.ended.is_some());
        self.bytes = self.runs.values().map(Run::bytes).sum();
    }

    pub(super) fn take_all(&mut self) -> HashMap<JobKey, Run> {
        self.bytes = 0;
        std::mem::take(&mut self.runs)
    }
}

impl Run {
    /// What it takes in memory, with its key.
    fn bytes(&self) -> usize {
        self.ended.as_ref().map_or(0, Bytes::len) + size_of::<(JobKey, Self)>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_waits_is_bounded_also_where_it_is_only_said_to_be_made() {
        let most = 9000;
        let mut waiting = Waiting { most, ..Waiting::default() };
        let run = |worker, ended| Run { worker: WorkerId(worker), ended, passed: 0 };
        let key = |i: u64| {
            let mut key = [0; 32];
            key[..8].copy_from_slice(&i.to_le_bytes());
            key
        };
        for i in 0..3 {
            waiting.put(key(i), run(1, Some(Bytes::from(vec![0; most / 3]))));
        }
        assert_eq!(waiting.runs.len(), 2, "each is a little more than a third");
        let room = most - waiting.bytes;
        let one = run(2, None).bytes();
        (3..4 + (room / one) as u64).for_each(|i| waiting.put(key(i), run(2, None)));
        assert_eq!(waiting.runs.len(), 2 + room / one);
        waiting.left(WorkerId(2));
        assert_eq!((waiting.runs.len(), most - waiting.bytes), (2, room));
        assert_eq!((waiting.take_all().len(), waiting.bytes), (2, 0));
    }
}
