//! The results of a batch as something that may have to be taken back: whose they are, and which are open again.
//!
//! Next file to read: [`crate::dispatcher::canary`].

use starlings_models::Failure;
use starlings_proto::{State as Travelling, StateId};

use super::{Batch, Ended};
use crate::dispatcher::message::WorkerId;
use crate::dispatcher::opinion::Said;
use crate::wire::Prediction;

impl Batch {
    /// Whether a job has an outcome.
    pub(in crate::dispatcher) fn is_finished(&self, index: usize) -> bool {
        self.jobs[index].outcome.is_some()
    }

    /// The prediction of a job, or how the model failed, and who said so. A timeout is nothing that another one would say.
    pub(in crate::dispatcher) fn said(&self, index: usize) -> Option<(WorkerId, Said)> {
        let job = &self.jobs[index];
        let said = match &job.outcome.as_ref()?.result {
            Ok(prediction) => Ok(prediction.clone()),
            Err(failure @ Failure::Model(_)) => Err(failure.to_string()),
            Err(Failure::Timeout(_)) => return None,
        };
        Some((job.by?, said))
    }

    /// Whether an outcome names a state.
    pub(in crate::dispatcher) fn names_state(&self, id: &StateId) -> bool {
        let named = |job: &super::State| match &job.outcome.as_ref()?.result {
            Ok(Prediction { state: Travelling::Named(named), .. }) => Some(named == id),
            _ => None,
        };
        self.jobs.iter().any(|job| named(job) == Some(true))
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
            // Whoever was told of the outcome is told of the next one too, which takes its place.
            self.ended.retain(|ended| *ended != index);
            self.untold.retain(|untold| *untold != index);
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
