//! Runs that a worker brings along when it comes back: finished ones count as answers, those that it still makes become its leases.
//!
//! A worker that lost its coordinator, or the way to it, goes on with what it had. Whoever holds a lease for such a job at the moment
//! gives it up: the other is ahead. Next file to read: [`super::answers`].

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
        // A job in doubt is decided by runs of its own.
        if !batch.is_plain(index) || !self.workers.contains_key(&id) {
            return Taken::No;
        }
        let job = batch.job_number(index);
        let holder = self.workers.values_mut().find_map(|w| Some((w.id, w.take_back(job)?)));
        match holder {
            Some((other, lease)) if other != id => {
                self.out.push(Command::Cancel { worker: other, leases: vec![lease] });
            }
            Some(_) => {}
            None if batch.unqueue(index) => {}
            None => return Taken::No,
        }
        let Some(worker) = self.workers.get_mut(&id) else { return Taken::No };
        let lease = schedule::hold(worker, batch, index);
        match answer {
            Some((answer, cost)) => {
                self.answered(now, id, lease, answer, cost);
                Taken::Answer
            }
            None => Taken::Lease(lease),
        }
    }
}
