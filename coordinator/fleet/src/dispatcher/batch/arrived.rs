//! What of a batch is over while the batch goes on.
//!
//! Next file to read: [`super::super::schedule`], which ends a batch.

use super::Batch;
use crate::wire::Outcome;

impl Batch {
    /// Copies of the outcomes that were not handed on before, each with the place of its job.
    pub(in crate::dispatcher) fn arrived(&mut self) -> Vec<(usize, Outcome)> {
        let new = self.ended.iter().skip(std::mem::replace(&mut self.handed_on, self.ended.len()));
        new.filter_map(|&index| Some((index, self.jobs[index].outcome.clone()?))).collect()
    }
}
