//! Runs that take many times as long as runs usually do: given up, where the study says so.
//!
//! That is a decision by wall time, as the limit of a solver is: the run is tried once more on another worker, then the timeout
//! is its outcome, which whoever holds the batch keeps. Next file to read: [`super::answers`].

use std::time::Duration;

use starlings_models::Timeout;

use super::Dispatcher;
use super::message::Command;

/// Runs that must have ended before it is known how long they usually take.
const KNOWN: usize = 5;

/// No run is given up before this time: shorter ones wait for processors now and then.
const SHORTEST: f64 = 1.0;

impl Dispatcher {
    /// Gives up the runs that take far longer than usual.
    pub(super) fn watch_timeouts(&mut self, now: Duration) {
        let Some(factor) = self.rules.timeout_factor else { return };
        let Some(usual) = self.run_times.median().filter(|_| self.run_times.len() >= KNOWN) else { return };
        let Some(batch) = &self.batch else { return };
        let limit = (factor * usual).max(SHORTEST);
        let mut late = Vec::new();
        for worker in self.workers.values() {
            for (job, since) in worker.running() {
                let Some(index) = batch.index_of(job) else { continue };
                let is_late = now.saturating_sub(since).as_secs_f64() > limit && !worker.has_dropped(job);
                let is_plain = batch.doubt(index).is_none() && !batch.is_finished(index);
                if is_late && is_plain && !self.repeats.is_open(worker.id, index) {
                    late.extend(worker.lease_of(job).map(|lease| (worker.id, index, lease)));
                }
            }
        }
        for (id, index, lease) in late {
            if let Some(mut worker) = self.workers.get_mut(id) {
                worker.drop_lease(lease.job);
            }
            self.out.push(Command::Cancel { worker: id, leases: vec![lease], stop: true });
            let says = format!(
                "the run took more than {limit:.1} s, {factor} times the usual {usual:.3} s (`timeout_factor` in `[fleet]` sets the \
                 limit)"
            );
            if self.is_wanted(index) {
                self.decided(id, index, Timeout { limit, says }.into());
            }
        }
    }

    /// Whether nobody else computes a job that has no outcome.
    fn is_wanted(&self, index: usize) -> bool {
        let Some(batch) = &self.batch else { return false };
        let job = batch.job_number(index);
        !batch.is_finished(index) && !self.workers.values().any(|w| w.holds(job) && !w.has_dropped(job))
    }
}
