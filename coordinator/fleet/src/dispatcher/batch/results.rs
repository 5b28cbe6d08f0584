//! The results of a batch as something that may have to be taken back: whose they are, and which are open again.
//!
//! Next file to read: [`crate::dispatcher::canary`].

use starlings_models::Failure;
use starlings_proto::{State as Travelling, StateId};

use super::{Batch, Ended};
use crate::dispatcher::message::WorkerId;
use crate::dispatcher::opinion::Said;
use crate::wire::{Outcome, Prediction};

impl Batch {
    /// Whether a job has an outcome.
    pub(in crate::dispatcher) fn is_finished(&self, index: usize) -> bool {
        self.outcomes[index].is_some()
    }

    /// The prediction of a job, or how the model failed, and who said so. A timeout is nothing that another one would say.
    pub(in crate::dispatcher) fn said(&self, index: usize) -> Option<(WorkerId, Said)> {
        let said = match &self.outcomes[index].as_ref()?.result {
            Ok(prediction) => Ok(prediction.clone()),
            Err(failure @ Failure::Model(_)) => Err(failure.to_string()),
            Err(Failure::Timeout(_)) => return None,
        };
        Some((self.jobs[index].by?, said))
    }

    /// Whether an outcome names a state.
    pub(in crate::dispatcher) fn names_state(&self, id: &StateId) -> bool {
        let names = |outcome: &Outcome| match &outcome.result {
            Ok(Prediction { state: Travelling::Named(named), .. }) => named == id,
            _ => false,
        };
        self.outcomes.iter().flatten().any(names)
    }

    /// The jobs that ended with what this worker answered.
    pub(in crate::dispatcher) fn made_by(&self, worker: WorkerId) -> Vec<usize> {
        let by = |index: &usize| self.is_finished(*index) && self.jobs[*index].by == Some(worker);
        (0..self.jobs.len()).filter(by).collect()
    }

    /// Takes an outcome back: the job is as one that was never tried.
    pub(in crate::dispatcher) fn reopen(&mut self, index: usize) {
        if self.outcomes[index].take().is_some() {
            let job = &mut self.jobs[index];
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
        !self.is_finished(index) && job.doubt.is_none() && job.avoided != Some(worker)
    }
}
