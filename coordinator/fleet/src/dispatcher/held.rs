//! Runs that a worker brings along when it comes back: finished ones count as answers, those that it still makes become its leases.
//!
//! A worker that lost its coordinator, or the way to it, goes on with what it had. Whoever else has such a job at the moment is told
//! to stop it, since the other is ahead; its lease goes with its answer. Next file to read: [`super::answers`].

use std::time::Duration;

use starlings_proto::{Lease, LeaseOutcome};

use super::Dispatcher;
use super::message::{Command, WorkerId};
use super::schedule;

/// What has become of a run that a worker brought along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    /// Its result counts.
    Answer,
    /// The worker goes on with it, under a lease.
    Lease(Lease),
    /// Nobody needs it.
    No,
}

impl Dispatcher {
    /// A worker brings along a job of the running batch: finished, with what it cost in seconds, or still being made.
    pub(crate) fn held(
        &mut self,
        now: Duration,
        id: WorkerId,
        index: usize,
        answer: Option<(LeaseOutcome, f64)>,
    ) -> (Taken, Vec<Command>) {
        let taken = self.take_held(now, id, index, answer);
        self.proceed();
        (taken, std::mem::take(&mut self.out))
    }

    fn take_held(
        &mut self,
        now: Duration,
        id: WorkerId,
        index: usize,
        answer: Option<(LeaseOutcome, f64)>,
    ) -> Taken {
        self.heard(now, id);
        let Some(batch) = &mut self.batch else { return Taken::No };
        // A job in doubt, or that failed before, is decided by runs of its own.
        if !batch.is_plain(index) {
            return Taken::No;
        }
        let job = batch.job_number(index);
        // What it was given since is answered by itself.
        if self.workers.get(id).is_none_or(|worker| worker.holds(job)) {
            return Taken::No;
        }
        let mut is_held = false;
        let others = self.workers.values().filter(|w| w.holds(job) && !w.has_dropped(job));
        for id in others.map(|w| w.id).collect::<Vec<_>>() {
            let Some(mut other) = self.workers.get_mut(id) else { continue };
            let Some(lease) = other.lease_of(job) else { continue };
            other.drop_lease(job);
            is_held = true;
            self.out.push(Command::Cancel { worker: other.id, leases: vec![lease], stop: true });
        }
        if !is_held && !batch.unqueue(index) {
            return Taken::No;
        }
        let Some(mut worker) = self.workers.get_mut(id) else { return Taken::No };
        let lease = schedule::hold(&mut worker, batch, index, now);
        drop(worker);
        match answer {
            Some((answer, cost)) => {
                self.answered(now, id, lease, answer, cost);
                Taken::Answer
            }
            None => Taken::Lease(lease),
        }
    }
}
