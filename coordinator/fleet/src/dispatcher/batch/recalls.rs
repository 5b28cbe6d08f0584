//! Which jobs of a batch may be called back.

use std::collections::BTreeSet;

use starlings_proto::SetupId;

use super::Batch;

impl Batch {
    /// A job is recalled only for one of these setups, and at most once, so that it cannot be sent to and fro without end.
    pub(in crate::dispatcher) fn may_recall(&self, job: u64, setups: &BTreeSet<SetupId>) -> bool {
        self.index_of(job).is_some_and(|index| {
            let job = &self.jobs[index];
            // A repeat goes nowhere else.
            !job.recalled
                && job.doubt.is_none()
                && !self.is_finished(index)
                && setups.contains(self.setup_of(index))
        })
    }

    pub(in crate::dispatcher) fn mark_recalled(&mut self, job: u64) {
        if let Some(index) = self.index_of(job) {
            self.jobs[index].recalled = true;
        }
    }
}
