//! What is told of the jobs of a batch.
//!
//! Next file to read: [`crate::FleetEvent`].

use super::{Batch, Ended};
use crate::FleetEvent;
use crate::dispatcher::message::Command;
use crate::job_name::JobName;

impl Batch {
    /// How far the batch is, when that changed.
    pub(in crate::dispatcher) fn progress(&mut self) -> Option<FleetEvent> {
        let changed = self.told != self.ended.len();
        self.told = self.ended.len();
        changed.then_some(FleetEvent::Progress { done: self.ended.len(), total: self.jobs.len() })
    }

    /// What a job is called in a sentence.
    pub(in crate::dispatcher) fn describe(&self, job: u64) -> String {
        let name = self.index_of(job).and_then(|index| self.names.get(index));
        name.map_or_else(|| format!("run {job}"), |n| format!("particle {}, record {}", n.particle, n.record))
    }

    /// How a job's last failed attempt ended.
    pub(in crate::dispatcher) fn last_words(&self, index: usize) -> String {
        match self.jobs[index].earlier.as_ref().map(|earlier| &earlier.end) {
            Some(Ended::Decided(failure)) => failure.to_string(),
            Some(Ended::Undecided(text)) => text.clone(),
            None => String::new(),
        }
    }

    /// That a control run was made for a job, and why it failed, where it did.
    pub(in crate::dispatcher) fn controlled(
        &self,
        index: usize,
        worker: &str,
        fault: Option<String>,
    ) -> FleetEvent {
        let JobName { particle, record, .. } = self.names[index];
        FleetEvent::ControlRun { particle, record, worker: worker.to_owned(), fault }
    }

    pub(in crate::dispatcher) fn retried(&self, index: usize, worker: &str, reason: &str) -> FleetEvent {
        let JobName { particle, record, .. } = self.names[index];
        FleetEvent::JobRetried { particle, record, worker: worker.to_owned(), reason: reason.to_owned() }
    }

    /// That a job ended with a failure; its parameters are known to whoever holds the jobs.
    pub(in crate::dispatcher) fn failed(&self, index: usize) -> Command {
        let outcome = self.outcomes[index].as_ref();
        let reason = outcome.and_then(|o| o.result.as_ref().err()).map(ToString::to_string);
        self.given_up(index, outcome.map_or(0, |o| o.attempts), reason.unwrap_or_default())
    }

    /// That a job is given up after so many attempts.
    pub(in crate::dispatcher) fn given_up(&self, index: usize, attempts: u32, reason: String) -> Command {
        let JobName { particle, record, .. } = self.names[index];
        let notice = FleetEvent::JobFailed { particle, record, parameters: Vec::new(), attempts, reason };
        Command::GivenUp { index, notice }
    }
}
