//! The jobs of a batch that wait to be given: those never given before, in job order, and those that come back.
//!
//! Jobs of one setup wait behind each other; a setup that is still being built does not hold up the jobs of others. Who may
//! get a job is not decided here. Next file to read: `hand_out`.

use std::collections::{BTreeMap, VecDeque};

use super::message::WorkerId;

/// Jobs that come back: whom they must not go to, and which setup of the batch they need.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Again {
    /// The worker on which the model failed.
    pub(super) avoided: Option<WorkerId>,
    /// Position of the setup in the batch.
    pub(super) setup: usize,
}

/// What waits.
#[derive(Debug)]
pub(super) struct Queue {
    /// Per setup, the jobs never given.
    fresh: Vec<VecDeque<usize>>,
    /// The first fresh job of each setup, with the setup.
    heads: BTreeMap<usize, usize>,
    again: BTreeMap<Again, VecDeque<usize>>,
}

impl Queue {
    /// Jobs 0, 1, ... with the setup of each.
    pub(super) fn new(n_setup: usize, setup_of: impl Iterator<Item = usize>) -> Self {
        let mut queue =
            Self { fresh: vec![VecDeque::new(); n_setup], heads: BTreeMap::new(), again: BTreeMap::new() };
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

    /// Puts a job back.
    pub(super) fn put_back(&mut self, index: usize, again: Again) {
        self.again.entry(again).or_default().push_back(index);
    }

    /// The kinds of jobs that come back.
    pub(super) fn again(&self) -> Vec<Again> {
        self.again.iter().filter(|(_, jobs)| !jobs.is_empty()).map(|(&key, _)| key).collect()
    }

    /// Whether such a job waits.
    pub(super) fn has(&self, again: Again) -> bool {
        self.again.get(&again).is_some_and(|jobs| !jobs.is_empty())
    }

    /// Takes one job that comes back.
    pub(super) fn next_again(&mut self, again: Again) -> Option<usize> {
        self.again.get_mut(&again)?.pop_front()
    }

    /// Takes all of them.
    pub(super) fn take_all(&mut self, again: Again) -> Vec<usize> {
        Vec::from(self.again.remove(&again).unwrap_or_default())
    }
}
