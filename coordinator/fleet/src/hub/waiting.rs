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
    /// Keeps a run; one that is finished is not displaced by one that is not.
    pub(super) fn put(&mut self, key: JobKey, mut run: Run) {
        let before = self.runs.get(&key);
        if before.is_some_and(|before| before.ended.is_some() && run.ended.is_none()) {
            return;
        }
        let kept = self.bytes - before.map_or(0, Run::bytes);
        if kept + run.bytes() > self.most {
            return;
        }
        // What came lies in the message that brought it, with all else that it brought.
        run.ended = run.ended.map(|ended| Bytes::copy_from_slice(&ended));
        self.bytes = kept + run.bytes();
        self.runs.insert(key, run);
    }

    /// What a worker brought along goes with it: nobody could be asked what it was made with. One that comes back brings it again.
    pub(super) fn left(&mut self, worker: WorkerId) {
        self.runs.retain(|_, run| run.worker != worker);
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

    #[test]
    fn a_small_part_of_a_large_message_does_not_keep_all_of_it() {
        let mut waiting = Waiting::default();
        let message = Bytes::from(vec![7; 1 << 20]);
        waiting.put([1; 32], Run { worker: WorkerId(1), ended: Some(message.slice(5..15)), passed: 0 });
        assert!(message.is_unique(), "nobody else holds the message");
        assert_eq!(waiting.runs[&[1; 32]].ended.as_deref(), Some(&[7; 10][..]));
    }

    #[test]
    fn what_waits_goes_with_the_worker_that_brought_it_and_a_finished_run_stays_before_an_unfinished_one() {
        let mut waiting = Waiting::default();
        let run = |worker, ended: Option<&'static [u8]>| Run {
            worker: WorkerId(worker),
            ended: ended.map(Bytes::from_static),
            passed: 0,
        };
        waiting.put([1; 32], run(1, Some(b"made")));
        waiting.put([1; 32], run(2, None));
        assert_eq!(waiting.runs[&[1; 32]].worker, WorkerId(1));
        waiting.put([2; 32], run(2, None));
        waiting.put([2; 32], run(1, Some(b"made")));
        assert_eq!(waiting.runs[&[2; 32]].worker, WorkerId(1));
        let bytes = waiting.bytes;
        waiting.put([2; 32], run(1, Some(b"made")));
        assert_eq!(waiting.bytes, bytes, "once");
        waiting.left(WorkerId(1));
        assert_eq!((waiting.runs.len(), waiting.bytes), (0, 0));
    }
}
