//! Jobs that a worker brings along.
//!
//! Next file to read: [`super::super::held`].

use super::super::queue::RetryKey;
use super::Batch;

impl Batch {
    /// Whether a job has no outcome, and no attempt of it has failed.
    pub(in crate::dispatcher) fn is_plain(&self, index: usize) -> bool {
        let job = &self.jobs[index];
        let is_untried = job.earlier.is_none() && job.doubt.is_none();
        !self.is_finished(index) && is_untried && !self.parked.contains_key(&index)
    }

    /// Takes out a job that waits for a worker; false where it does not wait.
    pub(in crate::dispatcher) fn unqueue(&mut self, index: usize) -> bool {
        let job = &self.jobs[index];
        self.queue.remove(index, RetryKey { avoided: job.avoided, setup: job.setup })
    }
}
