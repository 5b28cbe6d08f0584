//! What follows from a worker's answer: an outcome, another attempt, or a worker set aside.
//!
//! Next files to read: [`super::doubt`], [`super::aside`].

use std::time::Duration;

use starlings_models::{Failure, ParticleError};
use starlings_proto::{Lease, LeaseOutcome};

use super::Dispatcher;
use super::batch::{Doubt, Ended};
use super::message::{BatchError, Command, WorkerId};
use crate::FleetEvent;
use crate::wire::Prediction;

impl Dispatcher {
    pub(super) fn answered(
        &mut self,
        now: Duration,
        id: WorkerId,
        lease: Lease,
        answer: LeaseOutcome,
        cost: f64,
    ) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        worker.last_heard = now;
        let valid = lease.epoch == id.0 && worker.release(lease.job, lease.attempt);
        let index = self.batch.as_ref().and_then(|batch| batch.index_of(lease.job));
        let (true, Some(index), Some(batch)) = (valid, index, &mut self.batch) else {
            if matches!(answer, LeaseOutcome::Ran(_)) {
                let notice = FleetEvent::LateAnswer { worker: worker.name.clone(), job: lease.job };
                self.out.push(Command::Notice(notice));
            }
            return;
        };
        match answer {
            LeaseOutcome::Withdrawn => batch.withdrawn(index),
            LeaseOutcome::Ran(result) if matches!(batch.doubt(index), Some(Doubt::Control(_))) => {
                self.controlled(now, id, index, result);
            }
            LeaseOutcome::Ran(Ok(prediction)) => {
                worker.learn_cost(cost);
                self.run_times.learn(cost);
                self.predicted(id, index, prediction);
            }
            LeaseOutcome::Ran(Err(error)) => self.failed(now, id, index, error),
        }
    }

    fn predicted(&mut self, id: WorkerId, index: usize, prediction: Prediction) {
        let Some(batch) = &mut self.batch else { return };
        let name = self.workers.get(&id).map_or("", |w| w.name.as_str());
        self.proven.learn(batch.name(index), batch.setup_of(index), index, &mut self.out);
        batch.set_doubt(index, None);
        batch.finish(index, Ok(prediction), name);
        self.works(id);
    }

    fn failed(&mut self, now: Duration, id: WorkerId, index: usize, error: ParticleError) {
        match error {
            ParticleError::Model(failed) => {
                self.works(id);
                self.decided(id, index, failed.into());
            }
            ParticleError::Timeout(timeout) => self.decided(id, index, timeout.into()),
            ParticleError::Undecided(text) => self.doubted(id, index, text),
            ParticleError::Infrastructure(reason) => {
                if let Some(batch) = &mut self.batch {
                    batch.set_doubt(index, None);
                    batch.requeue(index);
                }
                self.set_aside(now, id, &reason);
            }
            // A job that does not fit the model fits it nowhere.
            ParticleError::BadJob(_) => {
                let attempts = self.batch.as_ref().map_or(0, |batch| batch.attempts(index));
                self.unanswered(index, attempts + 1, &error.to_string());
            }
        }
    }

    /// A failure of the model, or the limit of wall time: tried once more on another worker, if there is one.
    fn decided(&mut self, id: WorkerId, index: usize, failure: Failure) {
        let Some(batch) = &mut self.batch else { return };
        let name = self.workers.get(&id).map_or("", |w| w.name.as_str());
        batch.set_doubt(index, None);
        let setup = batch.setup_of(index);
        let other = self.workers.values().any(|w| w.id != id && w.could_take(setup));
        if other && batch.may_retry(index) {
            self.out.push(Command::Notice(batch.retried(index, name, &failure.to_string())));
            batch.retry_elsewhere(index, id, Ended::Decided(failure), name);
        } else {
            batch.finish(index, Err(failure), name);
            self.out.push(batch.failed(index));
        }
    }

    /// A job that nobody can answer ends the batch: that says nothing of its parameters.
    pub(super) fn unanswered(&mut self, index: usize, attempts: u32, reason: &str) {
        let Some(batch) = &self.batch else { return };
        self.out.push(batch.given_up(index, attempts, reason.to_owned()));
        let attempts = format!("given up after {attempts} attempt{}", if attempts == 1 { "" } else { "s" });
        let (name, reason) = (batch.name(index), format!("{attempts}: {reason}"));
        self.abort(BatchError::NoAnswer { index, particle: name.particle, record: name.record, reason });
    }
}
