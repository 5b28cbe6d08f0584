//! What of a batch is over while the batch goes on.
//!
//! Next file to read: [`super::super::belief`], for whose outcomes have to wait.

use std::collections::BTreeSet;

use super::Batch;
use crate::dispatcher::message::WorkerId;
use crate::wire::Outcome;

impl Batch {
    /// Copies of the outcomes that were not handed on before, each with the place of its job; those of workers in doubt wait.
    pub(in crate::dispatcher) fn arrived(&mut self, in_doubt: &BTreeSet<WorkerId>) -> Vec<(usize, Outcome)> {
        let waits = |index: &usize| self.jobs[*index].by.is_some_and(|by| in_doubt.contains(&by));
        let (waiting, new): (Vec<_>, Vec<_>) = std::mem::take(&mut self.untold).into_iter().partition(waits);
        self.untold = waiting;
        new.into_iter().filter_map(|index| Some((index, self.outcomes[index].clone()?))).collect()
    }
}
