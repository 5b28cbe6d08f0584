//! One job of a worker: what runs it, the word that stops it, and who wants the answer.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use starlings_models::{Forward, Job, ParticleError, Stop};
use starlings_proto::{JobKey, Lease, SetupId};
use starlings_traces::{Span, TraceParent, Traces};
use tokio::sync::OwnedSemaphorePermit;

use crate::held::Of;
use crate::outbox::Outbox;
use crate::transfer::Transfers;

/// One job with everything needed to run and answer it.
pub(crate) struct Task {
    pub(crate) setup: SetupId,
    pub(crate) forward: Arc<dyn Forward>,
    pub(crate) job: Arc<Job>,
    /// Its key, where that was made of the name of a large state.
    key: Option<JobKey>,
    /// What its large state takes of the room for jobs that have not started.
    room: Mutex<Option<OwnedSemaphorePermit>>,
    /// The word that stops it.
    pub(super) stop: Stop,
    /// Who wants the answer. A stream that ends takes it away, and a later one may ask again.
    asked: Mutex<Option<Asked>>,
}

/// A lease and the way of its answer.
#[derive(Clone)]
pub(crate) struct Asked {
    pub(crate) lease: Lease,
    pub(crate) outbox: Outbox,
    /// The way of a large end state.
    pub(crate) transfers: Transfers,
    /// Where its run belongs in a trace.
    pub(crate) traced: Option<Traced>,
}

/// Where a run belongs in a trace, and where its own span goes.
#[derive(Clone)]
pub(crate) struct Traced {
    above: TraceParent,
    traces: Option<Traces>,
}

impl Traced {
    /// Nothing where the coordinator says nothing that is understood.
    pub(crate) fn new(traceparent: Option<String>, traces: Option<&Traces>) -> Option<Self> {
        let above = traceparent?.parse().ok()?;
        Some(Self { above, traces: traces.cloned() })
    }
}

impl Task {
    pub(crate) fn new(asked: Asked, setup: SetupId, forward: Arc<dyn Forward>, job: Job) -> Self {
        let (job, stop, asked) = (Arc::new(job), Stop::default(), Mutex::new(Some(asked)));
        Self { setup, forward, job, key: None, room: Mutex::default(), stop, asked }
    }

    /// The same for a job whose large state arrived by itself.
    pub(crate) fn large(
        asked: Asked,
        setup: SetupId,
        forward: Arc<dyn Forward>,
        job: Job,
        key: JobKey,
        room: OwnedSemaphorePermit,
    ) -> Self {
        Self { key: Some(key), room: Mutex::new(Some(room)), ..Self::new(asked, setup, forward, job) }
    }

    /// The key of its job, or what it is made of.
    pub(super) fn of(&self) -> Of {
        self.key.map_or_else(|| Of::Job(self.setup, Arc::clone(&self.job)), Of::Key)
    }

    /// Whether it begins from a large state.
    pub(super) fn is_large(&self) -> bool {
        self.key.is_some()
    }

    /// The memory of the large state that it began from, unless somebody has it too.
    pub(super) fn into_large_state(self: Arc<Self>) -> Option<Vec<f64>> {
        let task = Arc::into_inner(self).filter(|task| task.key.is_some())?;
        Arc::into_inner(task.job)?.state?.into_own()
    }

    /// It waits no more: its place among those that do is free.
    pub(super) fn begun(&self) {
        drop(self.room.lock().unwrap_or_else(PoisonError::into_inner).take());
    }

    pub(super) fn asked(&self) -> MutexGuard<'_, Option<Asked>> {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins its span, where spans are written; with what a program that runs it has as its parent.
    pub(super) fn traced(&self) -> (Option<Span>, Option<String>) {
        let asked = self.asked();
        let Some((lease, traced)) =
            asked.as_ref().and_then(|asked| Some((asked.lease, asked.traced.as_ref()?)))
        else {
            return (None, None);
        };
        let Job { particle, record, .. } = *self.job;
        let about = [
            ("starlings.particle", i64::from(particle).into()),
            ("starlings.record", i64::from(record).into()),
            ("starlings.epoch", i64::try_from(lease.epoch).unwrap_or(i64::MAX).into()),
        ];
        let span = traced.traces.as_ref().map(|traces| traces.begin("compute", Some(&traced.above), about));
        let parent = span.as_ref().map_or_else(|| traced.above.clone(), Span::parent);
        (span, Some(parent.to_string()))
    }

    /// Says in the log how it ended, after so many seconds.
    pub(super) fn log(&self, failure: Option<&ParticleError>, seconds: f64) {
        // Who asks for it is looked up for nobody otherwise.
        if tracing::enabled!(tracing::Level::DEBUG) {
            let Job { particle, record, .. } = *self.job;
            let epoch = self.asked().as_ref().map(|asked| asked.lease.epoch);
            let failure = failure.map(tracing::field::display);
            tracing::debug!(event = "ran", particle, record, epoch, seconds, failure, "a run has ended");
        }
    }

    pub(super) fn has_lease(&self, leases: &[Lease]) -> bool {
        self.asked().as_ref().is_some_and(|asked| leases.contains(&asked.lease))
    }
}
