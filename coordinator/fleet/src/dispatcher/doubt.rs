//! Abnormal ends: control runs tell whether the parameters or the worker's host cause them.
//!
//! A program that crashes or answers nonsense says nothing of θ by itself: a licence that ran out looks the same. The run is tried
//! once more, elsewhere if possible. If it fails there too, a run over the same record and window that is known to work is made in
//! that very place, and after it the failed one once more. A known run that fails shows that the place is at fault; one that works
//! between two failures shows that the parameters are. Until some run of that window is known to work, the job waits; when nothing
//! else is left that could work, the batch ends with an error. Next files to read: [`super::aside`], [`super::proven`].

use std::time::Duration;

use starlings_models::{Failure, ModelFailure, ParticleError};
use starlings_proto::Lease;

use super::Dispatcher;
use super::batch::{Batch, Doubt, Ended};
use super::message::{BatchError, Command, ControlId, WorkerId};
use super::schedule::lease;
use super::workers::Changing;
use crate::wire::Prediction;

impl Dispatcher {
    /// An abnormal end: tried once more, and then decided by a control run in the same place.
    pub(super) fn doubted(&mut self, id: WorkerId, index: usize, text: String) {
        let Some(batch) = &mut self.batch else { return };
        let name = self.workers.get(id).map_or("", |w| w.name.as_str());
        if batch.doubt(index) == Some(Doubt::Confirmed) {
            batch.set_doubt(index, None);
            batch.finish(index, Err(Failure::Model(ModelFailure::Solver(text))), (id, name));
            self.out.push(batch.failed(index));
            return;
        }
        if !batch.may_retry(index) {
            batch.remember(index, Ended::Undecided(text), name);
            batch.park(index, id);
            return;
        }
        let setup = batch.setup_of(index);
        let other = self.workers.values().any(|w| w.id != id && w.could_take(setup));
        self.out.push(Command::Notice(batch.retried(index, name, &text)));
        let end = Ended::Undecided(text);
        if other {
            batch.retry_elsewhere(index, id, end, name);
        } else {
            batch.remember(index, end, name);
            batch.requeue(index);
        }
    }

    /// Starts the control runs that have become possible; ends the batch when none can become so.
    pub(super) fn control(&mut self) {
        let Some(batch) = &mut self.batch else { return };
        if batch.parked().is_empty() {
            return;
        }
        for (index, by) in batch.parked().clone() {
            let job = batch.job_number(index);
            let may = |w: &Changing<'_>| w.may_control(batch.setup_of(index)) && !w.holds(job);
            let place = self.workers.get_mut(by).filter(may);
            let Some(mut worker) = place else {
                // It fails once more in another place, and that one is asked.
                if self.proven.knows(batch.name(index)) {
                    batch.unpark(index);
                    batch.requeue(index);
                }
                continue;
            };
            let known = self.proven.find(batch.name(index), batch.setup_of(index), |s| worker.is_ready(s));
            let Some(control) = known else { continue };
            batch.unpark(index);
            batch.set_doubt(index, Some(Doubt::Control(control)));
            let lease =
                Lease { epoch: worker.id.0, job: batch.job_number(index), attempt: batch.start(index) };
            worker.hold(lease, self.now);
            self.out.push(Command::SendControl { worker: worker.id, lease, control });
        }
        let stuck = batch.parked().len() == batch.n_unfinished();
        if let Some(&index) = batch.parked().keys().next().filter(|_| stuck) {
            let (name, reason, parameters) = (batch.name(index), batch.last_words(index), String::new());
            let (particle, record) = (name.particle, name.record);
            self.abort(BatchError::NoControl { index, particle, record, parameters, reason });
        }
    }

    /// A control run ended: it works, so the job is made once more in the same place, or the place is at fault.
    pub(super) fn controlled(
        &mut self,
        now: Duration,
        id: WorkerId,
        index: usize,
        result: Result<Prediction, ParticleError>,
    ) {
        let Some(batch) = &mut self.batch else { return };
        let Some(mut worker) = self.workers.get_mut(id) else { return };
        let fault = result.err().map(|error| error.to_string());
        self.out.push(Command::Notice(batch.controlled(index, &worker.name, fault.clone())));
        match fault {
            // The worker forgot the setup meanwhile: the job waits until somebody has built it.
            None if !worker.is_ready(batch.setup_of(index)) => {
                drop(worker);
                batch.set_doubt(index, None);
                batch.requeue(index);
                self.works(id);
            }
            None => {
                batch.set_doubt(index, Some(Doubt::Confirmed));
                self.out.push(lease(&mut worker, batch, index, now));
                drop(worker);
                self.works(id);
            }
            Some(fault) => {
                drop(worker);
                batch.set_doubt(index, None);
                batch.requeue(index);
                self.set_aside(now, id, &format!("a run that worked before fails there: {fault}"));
            }
        }
    }

    /// Whether a lease is open: its worker may still answer for its job.
    pub(crate) fn holds(&self, lease: &Lease) -> bool {
        let worker = self.workers.get(WorkerId(lease.epoch));
        worker.is_some_and(|worker| worker.lease_of(lease.job) == Some(*lease))
    }

    /// What a lease of the running batch asks for.
    pub(crate) fn asked(&self, lease: &Lease) -> Option<Asked> {
        let batch: &Batch = self.batch.as_ref()?;
        let index = batch.index_of(lease.job)?;
        Some(match batch.doubt(index) {
            Some(Doubt::Control(control)) => Asked::Control(control),
            _ => Asked::Job(index),
        })
    }
}

/// What a lease asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
    /// The job of this index.
    Job(usize),
    /// A kept job.
    Control(ControlId),
}
