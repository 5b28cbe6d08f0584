//! The results of a batch as something that may have to be taken back: whose they are, and which are open again.
//!
//! Next file to read: [`crate::dispatcher::canary`].

use starlings_models::{Failure, Prediction};

use super::{Batch, Ended};
use crate::dispatcher::message::WorkerId;

impl Batch {
    /// Whether a job has an outcome.
    pub(in crate::dispatcher) fn is_finished(&self, index: usize) -> bool {
        self.jobs[index].outcome.is_some()
    }

    /// The prediction of a job and who made it.
    pub(in crate::dispatcher) fn prediction(&self, index: usize) -> Option<(WorkerId, &Prediction)> {
        let job = &self.jobs[index];
        job.by.zip(job.outcome.as_ref()?.result.as_ref().ok())
    }

    /// The jobs that ended with what this worker answered.
    pub(in crate::dispatcher) fn made_by(&self, worker: WorkerId) -> Vec<usize> {
        let by = |(index, _): &(usize, _)| self.jobs[*index].by == Some(worker);
        let ended = self.jobs.iter().enumerate().filter(|(_, job)| job.outcome.is_some());
        ended.filter(by).map(|(index, _)| index).collect()
    }

    /// Takes an outcome back: the job is as one that was never tried.
    pub(in crate::dispatcher) fn reopen(&mut self, index: usize) {
        let job = &mut self.jobs[index];
        if job.outcome.take().is_some() {
            (job.by, job.earlier, job.avoided) = (None, None, None);
            self.done -= 1;
            self.open[job.setup] += 1;
        }
    }

    /// The model failure that an earlier attempt of a job ended with, and on whom.
    pub(in crate::dispatcher) fn failed_before(&self, index: usize) -> Option<(WorkerId, String)> {
        let job = &self.jobs[index];
        match &job.earlier.as_ref()?.end {
            Ended::Decided(failure @ Failure::Model(_)) => Some((job.avoided?, failure.to_string())),
            _ => None,
        }
    }

    /// Whether a job may be given to a worker while another one has it: nobody is finding out what is wrong with it.
    pub(in crate::dispatcher) fn may_duplicate(&self, index: usize, worker: WorkerId) -> bool {
        let job = &self.jobs[index];
        job.outcome.is_none() && job.doubt.is_none() && job.avoided != Some(worker)
    }
}
