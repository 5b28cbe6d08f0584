//! Scheduling, done after every event: failures settle, control runs are made, jobs are assigned and recalled, the batch ends.

use std::collections::BTreeSet;
use std::time::Duration;

use starlings_proto::{Lease, SetupId};

use super::Dispatcher;
use super::batch::Batch;
use super::message::{BatchError, Command, WorkerId};
use super::roster::{SetupState, Worker};
use super::workers::Workers;

impl Dispatcher {
    /// Everything that may follow from any event: settle, make control runs, compare, assign, recall, end.
    pub(super) fn proceed(&mut self) {
        // What was settled before a worker was put out may have waited for that worker, and no other event need come.
        while self.settle() {}
        if self.is_open() {
            self.assign();
        }
        self.recall();
        if self.batch.as_ref().is_some_and(Batch::is_done)
            && self.is_compared()
            && let Some(batch) = self.batch.take()
        {
            self.starved = None;
            self.overdue = None;
            self.out.push(Command::BatchDone(batch.into_outcomes()));
        }
    }

    /// Settles what can be settled and starts control runs and repeats; says whether a worker was found wrong by it.
    fn settle(&mut self) -> bool {
        let n_wrong = self.repeats.wrong.len();
        if self.local_only {
            self.fail_without_setup();
        }
        self.settle_failures();
        // Before jobs are assigned: a place on trial makes one run at a time, and this one tells more.
        self.control();
        if self.is_open() {
            self.canaries();
        }
        self.repeats.wrong.len() > n_wrong
    }

    /// Whether jobs are given away now.
    fn is_open(&self) -> bool {
        self.now >= self.opens && !self.is_matching
    }

    /// Ends the batch when none of the workers can build a setup that it still needs, and no others will come.
    fn fail_without_setup(&mut self) {
        let Some(batch) = &self.batch else { return };
        let reason = batch.open_setups().find_map(|setup| self.failed_everywhere(setup));
        if let Some(reason) = reason {
            self.abort(BatchError::SetupFailed { reason });
        }
    }

    /// Why no worker can build a setup; `None` when there is no worker, or one may still build it.
    pub(super) fn failed_everywhere(&self, setup: &SetupId) -> Option<String> {
        let mut reasons = Vec::<&str>::new();
        for worker in self.workers.values() {
            match worker.setups.get(setup) {
                Some(SetupState::Failed(reason)) if reasons.contains(&reason.as_str()) => {}
                Some(SetupState::Failed(reason)) => reasons.push(reason),
                _ => return None,
            }
        }
        (!reasons.is_empty()).then(|| reasons.join("; "))
    }

    /// Ends the failed jobs that wait for another worker when there is none; those whose failure is undecided may then go back to
    /// the one where they failed.
    fn settle_failures(&mut self) {
        let Some(batch) = &mut self.batch else { return };
        for key in batch.queue.retries() {
            let Some(avoided) = key.avoided else { continue };
            let setup = batch.setup(key.setup);
            let other = self.workers.values().any(|w| w.id != avoided && w.could_take(setup));
            if !other {
                for index in batch.settle(key) {
                    self.out.push(batch.failed(index));
                }
            }
        }
    }

    fn assign(&mut self) {
        let Some(batch) = &mut self.batch else { return };
        if batch.queue.is_empty() || !self.workers.have_room() {
            return;
        }
        for key in batch.queue.retries() {
            let setup = *batch.setup(key.setup);
            while let Some(index) = batch.queue.first_retry(key) {
                // One that was told to stop it and has not answered has it still.
                let job = batch.job_number(index);
                let may = |w: &Worker| Some(w.id) != key.avoided && !w.holds(job);
                let Some(mut worker) = self.workers.least_loaded(&setup, may) else { break };
                batch.queue.next_retry(key);
                self.out.push(lease(&mut worker, batch, index, self.now));
            }
        }
        // The earliest fresh job whose setup is built on a worker with room; jobs of setups still being built let it pass.
        while let Some(setup) = next_setup(&self.workers, batch) {
            let id = *batch.setup(setup);
            let Some(mut worker) = self.workers.least_loaded(&id, |_| true) else { break };
            let Some(index) = batch.queue.next_fresh(setup) else { break };
            self.out.push(lease(&mut worker, batch, index, self.now));
        }
    }

    /// Calls back jobs that wait behind a busy slot while another slot is idle.
    fn recall(&mut self) {
        let Some(batch) = &mut self.batch else { return };
        let (n_idle, n_returning) = self.workers.idle_and_returning();
        if n_idle <= n_returning || self.workers.overfull().next().is_none() {
            return;
        }
        let idle = self.workers.idle().collect::<Vec<_>>();
        let runnable = batch.open_setups().filter(|setup| idle.iter().any(|w| w.is_ready(setup)));
        let runnable = runnable.copied().collect::<BTreeSet<SetupId>>();
        let useful = idle.iter().filter(|w| runnable.iter().any(|setup| w.is_ready(setup)));
        let free: usize = useful.map(|w| w.slots - w.load()).sum();
        let mut passed = BTreeSet::new();
        // The fullest first; one whose waiting jobs have all been called back before is passed over.
        for _ in n_returning..free {
            let called = loop {
                let Some(id) = self.workers.overfull().find(|id| !passed.contains(id)) else { return };
                let victim = self.workers.get_mut(id);
                if let Some(held) =
                    victim.and_then(|mut w| w.youngest(|job| batch.may_recall(job, &runnable)))
                {
                    break held;
                }
                passed.insert(id);
            };
            batch.mark_recalled(called.job);
            let worker = WorkerId(called.epoch);
            self.out.push(Command::Cancel { worker, leases: vec![called], stop: false });
        }
    }
}

/// The setup of the earliest fresh job that a worker with room could run now.
fn next_setup(workers: &Workers, batch: &Batch) -> Option<usize> {
    if !workers.have_room() {
        return None;
    }
    batch.queue.fresh_setups().find(|&setup| workers.have_room_for(batch.setup(setup)))
}

/// Assigns a job to a worker.
pub(super) fn lease(worker: &mut Worker, batch: &mut Batch, index: usize, now: Duration) -> Command {
    let lease = hold(worker, batch, index, now);
    Command::SendJob { worker: worker.id, lease, index }
}

/// Counts a job as held by a worker.
pub(super) fn hold(worker: &mut Worker, batch: &mut Batch, index: usize, now: Duration) -> Lease {
    let lease = Lease { epoch: worker.id.0, job: batch.job_number(index), attempt: batch.start(index) };
    worker.hold(lease, now);
    lease
}
