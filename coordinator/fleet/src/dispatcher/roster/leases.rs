//! The leases that a worker holds: how old they are, which end, which do not matter any more.

use std::time::Duration;

use starlings_proto::Lease;

use super::{Released, Worker};

impl Worker {
    /// Marks a lease whose answer does not matter any more.
    pub(in crate::dispatcher) fn drop_lease(&mut self, job: u64) {
        if let Some(held) = self.held.get_mut(&job) {
            held.dropped = true;
        }
    }

    /// Whether the answer of a lease does not matter any more.
    pub(in crate::dispatcher) fn has_dropped(&self, job: u64) -> bool {
        self.held.get(&job).is_some_and(|held| held.dropped)
    }

    /// Time in which nothing could happen is no time of its runs.
    pub(in crate::dispatcher) fn stood_still(&mut self, gap: Duration, now: Duration) {
        self.last_heard = (self.last_heard + gap).min(now);
        for held in self.held.values_mut() {
            held.since = (held.since + gap).min(now);
            held.running_since = held.running_since.map(|since| (since + gap).min(now));
        }
    }

    /// Whether it has a lease of this job.
    pub(in crate::dispatcher) fn holds(&self, job: u64) -> bool {
        self.held.contains_key(&job)
    }

    /// Its lease of this job.
    pub(in crate::dispatcher) fn lease_of(&self, job: u64) -> Option<Lease> {
        let held = self.held.get(&job)?;
        Some(Lease { epoch: self.id.0, job, attempt: held.attempt })
    }

    /// Its leases, each with its age and the number of runs per slot that were to be made before it ended.
    pub(in crate::dispatcher) fn ages(&self, now: Duration) -> Vec<(u64, Duration, usize)> {
        let age = |job: &u64| self.held.get(job).map_or(now, |held| held.since);
        let aged = self.leases_in_order().into_iter().enumerate();
        aged.map(|(i, job)| (job, now.saturating_sub(age(&job)), i / self.slots + 1)).collect()
    }

    /// Ends a lease; `None` when it is not held.
    pub(in crate::dispatcher) fn release(&mut self, job: u64, attempt: u32) -> Option<Released> {
        self.held.get(&job).filter(|held| held.attempt == attempt)?;
        self.answers += 1;
        self.overtaken = 0;
        let held = self.held.remove(&job)?;
        self.n_recalled -= usize::from(held.recalled);
        Some(Released { recalled: held.recalled, dropped: held.dropped })
    }

    /// Its lease of this job, which is called back from it: that it gives the job back is no surprise then.
    pub(in crate::dispatcher) fn call_back(&mut self, job: u64) -> Option<Lease> {
        let was = std::mem::replace(&mut self.held.get_mut(&job)?.recalled, true);
        self.n_recalled += usize::from(!was);
        self.lease_of(job)
    }

    /// All its leases, which are called back.
    pub(in crate::dispatcher) fn call_back_all(&mut self) -> Vec<Lease> {
        self.held.values_mut().for_each(|held| held.recalled = true);
        self.n_recalled = self.held.len();
        self.leases().collect()
    }

    pub(in crate::dispatcher) fn leases(&self) -> impl Iterator<Item = Lease> + '_ {
        self.held.iter().map(|(&job, held)| Lease { epoch: self.id.0, job, attempt: held.attempt })
    }

    /// Jobs held, oldest lease first. Workers start jobs in this order, so the first ones were running.
    pub(in crate::dispatcher) fn leases_in_order(&self) -> Vec<u64> {
        let mut jobs = self.held.iter().map(|(&job, held)| (held.order, job)).collect::<Vec<_>>();
        jobs.sort_unstable();
        jobs.into_iter().map(|(_, job)| job).collect()
    }

    /// Marks the youngest lease that waits behind the running ones and `may` be called back.
    pub(in crate::dispatcher) fn youngest(&mut self, may: impl Fn(u64) -> bool) -> Option<Lease> {
        let waiting = self.leases_in_order().split_off(self.slots.min(self.load()));
        let open = |job: &u64| may(*job) && self.held.get(job).is_some_and(|held| !held.recalled);
        let job = waiting.into_iter().rfind(open)?;
        self.call_back(job)
    }
}
