//! A job in a worker, and who wants its answer.
//!
//! Next file to read: [`crate::slots`].

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use starlings_models::{Forward, Job, ParticleError};
use starlings_proto::{FromWorker, Lease, LeaseOutcome, SetupId, generated};
use tokio::sync::mpsc::UnboundedSender;

/// One job with everything needed to run and answer it.
pub(crate) struct Task {
    pub(crate) setup: SetupId,
    pub(crate) forward: Arc<dyn Forward>,
    pub(crate) job: Arc<Job>,
    /// Who wants the answer. A stream that ends takes it away, and a later one may ask again.
    asked: Mutex<Option<Asked>>,
}

/// A lease and the way of its answer.
#[derive(Clone)]
pub(crate) struct Asked {
    pub(crate) lease: Lease,
    pub(crate) outbox: UnboundedSender<generated::FromWorker>,
}

impl Task {
    pub(crate) fn new(asked: Asked, setup: SetupId, forward: Arc<dyn Forward>, job: Job) -> Self {
        Self { setup, forward, job: Arc::new(job), asked: Mutex::new(Some(asked)) }
    }

    pub(crate) fn asked(&self) -> MutexGuard<'_, Option<Asked>> {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn has_lease(&self, leases: &[Lease]) -> bool {
        self.asked().as_ref().is_some_and(|asked| leases.contains(&asked.lease))
    }
}

/// Answers a lease; an answer that does not fit in a message becomes a failure that says so.
pub(crate) fn answer(
    outbox: &UnboundedSender<generated::FromWorker>,
    lease: Lease,
    answer: LeaseOutcome,
    cost: f64,
) {
    let message = FromWorker::Result { lease, answer, cost }.encode().or_else(|error| {
        let answer = LeaseOutcome::Ran(Err(ParticleError::BadJob(error.to_string())));
        FromWorker::Result { lease, answer, cost }.encode()
    });
    if let Ok(message) = message {
        let _ = outbox.send(message);
    }
}
