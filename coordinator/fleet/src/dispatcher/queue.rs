//! The jobs of a batch that wait for a worker: fresh ones, in job order, and those to retry.
//!
//! Jobs of one setup wait behind each other; a setup that is still being built does not hold up the jobs of others. Which
//! worker gets a job is not decided here. Next file to read: `schedule`.

use std::collections::{BTreeMap, VecDeque};

use super::message::WorkerId;

/// What jobs to retry have in common: the worker to avoid and the setup of the batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct RetryKey {
    /// The worker on which the model failed.
    pub(super) avoided: Option<WorkerId>,
    /// Position of the setup in the batch.
    pub(super) setup: usize,
}

/// What waits.
#[derive(Debug)]
pub(super) struct Queue {
    /// Per setup, the jobs never assigned.
    fresh: Vec<VecDeque<usize>>,
    /// The first fresh job of each setup, with the setup.
    heads: BTreeMap<usize, usize>,
    /// Jobs to retry.
    retries: BTreeMap<RetryKey, VecDeque<usize>>,
}

impl Queue {
    /// Jobs 0, 1, ... with the setup of each.
    pub(super) fn new(n_setup: usize, setup_of: impl Iterator<Item = usize>) -> Self {
        let mut queue =
            Self { fresh: vec![VecDeque::new(); n_setup], heads: BTreeMap::new(), retries: BTreeMap::new() };
        for (index, setup) in setup_of.enumerate() {
            if queue.fresh[setup].is_empty() {
                queue.heads.insert(index, setup);
            }
            queue.fresh[setup].push_back(index);
        }
        queue
    }

    /// Setups with fresh jobs, the one of the earliest job first.
    pub(super) fn fresh_setups(&self) -> impl Iterator<Item = usize> + '_ {
        self.heads.values().copied()
    }

    /// Takes the earliest fresh job of a setup.
    pub(super) fn next_fresh(&mut self, setup: usize) -> Option<usize> {
        let index = self.fresh[setup].pop_front()?;
        self.heads.remove(&index);
        if let Some(&next) = self.fresh[setup].front() {
            self.heads.insert(next, setup);
        }
        Some(index)
    }

    /// Takes out a job that waits; false where it does not.
    pub(super) fn remove(&mut self, index: usize, key: RetryKey) -> bool {
        if let Some(jobs) = self.retries.get_mut(&key)
            && let Some(at) = jobs.iter().position(|job| *job == index)
        {
            jobs.remove(at);
            return true;
        }
        let fresh = &mut self.fresh[key.setup];
        let Ok(at) = fresh.binary_search(&index) else { return false };
        fresh.remove(at);
        self.heads.retain(|_, setup| *setup != key.setup);
        if let Some(&next) = fresh.front() {
            self.heads.insert(next, key.setup);
        }
        true
    }

    /// Whether no job waits.
    pub(super) fn is_empty(&self) -> bool {
        self.heads.is_empty() && self.retries.values().all(VecDeque::is_empty)
    }

    /// Jobs that wait.
    pub(super) fn len(&self) -> usize {
        let fresh: usize = self.fresh.iter().map(VecDeque::len).sum();
        fresh + self.retries.values().map(VecDeque::len).sum::<usize>()
    }

    /// Puts a job back.
    pub(super) fn put_back(&mut self, index: usize, key: RetryKey) {
        self.retries.entry(key).or_default().push_back(index);
    }

    /// The keys of the jobs to retry.
    pub(super) fn retries(&self) -> Vec<RetryKey> {
        self.retries.iter().filter(|(_, jobs)| !jobs.is_empty()).map(|(&key, _)| key).collect()
    }

    /// The first job with this key.
    pub(super) fn first_retry(&self, key: RetryKey) -> Option<usize> {
        self.retries.get(&key)?.front().copied()
    }

    /// Takes the first job with this key.
    pub(super) fn next_retry(&mut self, key: RetryKey) -> Option<usize> {
        self.retries.get_mut(&key)?.pop_front()
    }

    /// Takes all jobs with this key.
    pub(super) fn take_all(&mut self, key: RetryKey) -> Vec<usize> {
        Vec::from(self.retries.remove(&key).unwrap_or_default())
    }
}
