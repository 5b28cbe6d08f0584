//! What may follow from any event: failures settle, jobs are given out and called back, the batch ends.

use starlings_proto::{Lease, SetupId};

use super::Dispatcher;
use super::batch::Batch;
use super::message::{BatchError, Command, WorkerId};
use super::roster::{self, SetupState, Worker};

impl Dispatcher {
    /// Everything that may follow from any event: settle, give out, recall, end.
    pub(super) fn proceed(&mut self) {
        if self.local_only {
            self.fail_without_setup();
        }
        self.settle_failures();
        self.give_out();
        self.recall();
        if let Some(batch) = self.batch.take_if(|batch| batch.is_done()) {
            self.starved = None;
            self.overdue = None;
            self.out.push(Command::BatchDone(batch.into_outcomes()));
        }
    }

    /// Ends the batch when none of the workers can build its setup and no others will come.
    fn fail_without_setup(&mut self) {
        let Some(batch) = &self.batch else { return };
        if !batch.is_done()
            && let Some(reason) = self.failed_everywhere(&batch.setup)
        {
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

    /// Ends the failed jobs that wait for another worker when there is none.
    fn settle_failures(&mut self) {
        let Some(batch) = &mut self.batch else { return };
        for avoided in batch.avoided() {
            let other = self.workers.values().any(|w| w.id != avoided && w.may_run(&batch.setup));
            if !other {
                for index in batch.settle(avoided) {
                    self.out.push(Command::Notice(batch.failed(index)));
                }
            }
        }
    }

    fn give_out(&mut self) {
        let Some(batch) = &mut self.batch else { return };
        let setup = batch.setup;
        for avoided in batch.retry_keys() {
            while batch.has_retry(avoided) {
                let Some(worker) = roster::least_loaded(&mut self.workers, &setup, avoided) else { break };
                let Some(index) = batch.next_retry(avoided) else { break };
                self.out.push(lease(worker, batch, index));
            }
        }
        while batch.has_fresh() {
            let Some(worker) = roster::least_loaded(&mut self.workers, &setup, None) else { break };
            let Some(index) = batch.next_fresh() else { break };
            self.out.push(lease(worker, batch, index));
        }
    }

    /// Calls back jobs that wait behind a busy slot while another slot is idle.
    fn recall(&mut self) {
        let Some(batch) = &mut self.batch else { return };
        // While fresh jobs wait, no slot is idle: spares the counting below.
        if batch.has_fresh() {
            return;
        }
        let ready = || self.workers.values().filter(|w| w.is_ready(&batch.setup));
        let idle: usize = ready().map(|w| w.slots.saturating_sub(w.load())).sum();
        let mut open = match idle {
            0 => 0,
            idle => idle.saturating_sub(ready().map(Worker::n_returning).sum()),
        };
        let mut victims = Vec::<WorkerId>::new();
        if open > 0 {
            victims.extend(self.workers.values().filter(|w| w.surplus() > 0).map(|w| w.id));
        }
        // The fullest first; one whose waiting jobs have all been called back before is passed over.
        while open > 0 {
            let fullest =
                victims.iter().copied().max_by_key(|id| self.workers.get(id).map_or(0, Worker::surplus));
            let Some(victim) = fullest.and_then(|id| self.workers.get_mut(&id)) else { break };
            let held = if victim.surplus() > 0 { victim.youngest(|job| batch.may_recall(job)) } else { None };
            let Some(held) = held else {
                let passed = victim.id;
                victims.retain(|&id| id != passed);
                continue;
            };
            batch.mark_recalled(held.job);
            self.out.push(Command::Cancel { worker: victim.id, leases: vec![held] });
            open -= 1;
        }
    }
}

fn lease(worker: &mut Worker, batch: &mut Batch, index: usize) -> Command {
    let lease = Lease { epoch: worker.id.0, job: batch.job_number(index), attempt: batch.start(index) };
    worker.hold(lease);
    Command::SendJob { worker: worker.id, lease, index }
}
