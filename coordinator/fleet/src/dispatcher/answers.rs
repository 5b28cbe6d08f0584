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
        let Some((index, asked_back)) = self.released(now, id, lease, &answer) else { return };
        let is_shared = self.is_shared(index);
        let Some(batch) = &mut self.batch else { return };
        if self.repeats.ended(id, index) || batch.is_finished(index) {
            if answer == LeaseOutcome::Withdrawn && !asked_back {
                self.no_opinion(id, index);
            }
            return self.repeated(now, id, index, answer);
        }
        match answer {
            LeaseOutcome::Ran(Ok(prediction)) if !matches!(batch.doubt(index), Some(Doubt::Control(_))) => {
                if let Some(mut worker) = self.workers.get_mut(id) {
                    worker.learn_cost(cost);
                }
                self.run_times.learn(cost);
                self.overtake(now, id, index);
                self.predicted(id, index, prediction);
            }
            LeaseOutcome::Ran(Err(ParticleError::Infrastructure(reason))) if is_shared => {
                self.set_aside(now, id, &reason);
            }
            // Whoever has it too decides.
            _ if is_shared => {}
            LeaseOutcome::Withdrawn => {
                batch.withdrawn(index);
                if !asked_back {
                    self.stray(id, "it gives runs back that nobody called back, again and again");
                }
            }
            LeaseOutcome::Ran(result) if matches!(batch.doubt(index), Some(Doubt::Control(_))) => {
                self.controlled(now, id, index, result);
            }
            LeaseOutcome::Ran(Ok(_)) => {}
            LeaseOutcome::Ran(Err(error)) => self.failed(now, id, index, error),
        }
    }

    /// Ends the lease that is answered. Its job, unless it is of no batch any more, and whether it had been asked back.
    fn released(
        &mut self,
        now: Duration,
        id: WorkerId,
        lease: Lease,
        answer: &LeaseOutcome,
    ) -> Option<(usize, bool)> {
        let mut worker = self.workers.get_mut(id)?;
        worker.last_heard = now;
        let own = lease.epoch == id.0;
        let released = if own { worker.release(lease.job, lease.attempt) } else { None };
        let (batch, is_stray) = (self.batch.as_ref(), released.is_none());
        let found = batch.and_then(|batch| Some((batch, batch.index_of(lease.job)?)));
        let (Some(released), Some((batch, index))) = (released, found) else {
            if matches!(answer, LeaseOutcome::Ran(_)) {
                let notice = FleetEvent::LateAnswer { worker: worker.name.clone(), job: lease.job };
                self.out.push(Command::Notice(notice));
            }
            drop(worker);
            if is_stray {
                self.stray(id, "it answers runs that it was not given, again and again");
            }
            return None;
        };
        if released.dropped {
            return None;
        }
        if matches!(answer, LeaseOutcome::Ran(_)) {
            worker.strays = worker.strays.saturating_sub(1);
        }
        Some((index, released.recalled || worker.aside.is_some() || !worker.is_ready(batch.setup_of(index))))
    }

    fn predicted(&mut self, id: WorkerId, index: usize, prediction: Prediction) {
        self.succeeded_where_another_failed(id, index, &prediction);
        let Some(batch) = &mut self.batch else { return };
        let name = self.workers.get(id).map_or("", |w| w.name.as_str());
        self.proven.learn(batch.name(index), batch.setup_of(index), index, &mut self.out);
        batch.set_doubt(index, None);
        batch.finish(index, Ok(prediction), (id, name));
        self.contributed(id, index);
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
    pub(super) fn decided(&mut self, id: WorkerId, index: usize, failure: Failure) {
        let Some(batch) = &mut self.batch else { return };
        let name = self.workers.get(id).map_or("", |w| w.name.as_str());
        batch.set_doubt(index, None);
        let setup = batch.setup_of(index);
        let other = self.workers.values().any(|w| w.id != id && w.could_take(setup));
        if other && batch.may_retry(index) {
            self.out.push(Command::Notice(batch.retried(index, name, &failure.to_string())));
            batch.retry_elsewhere(index, id, Ended::Decided(failure), name);
        } else {
            let is_model = matches!(failure, Failure::Model(_)) && batch.may_retry(index);
            batch.finish(index, Err(failure), (id, name));
            self.out.push(batch.failed(index));
            if is_model {
                self.contributed(id, index);
            }
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
