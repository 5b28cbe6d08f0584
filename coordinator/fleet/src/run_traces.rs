//! One span per run that is given to a worker, from its lease to its end; the worker's own is below it.
//!
//! Only what is told of runs: nothing here decides, and without traces nothing is kept. Next file to read: `hub/state.rs`.

use std::collections::BTreeMap;

use starlings_proto::{Lease, LeaseOutcome};
use starlings_traces::{Span, TraceParent, Traces};

use super::dispatcher::WorkerId;
use super::wire::Job;

/// Where the spans of runs go, and the span that they are below.
#[derive(Clone)]
pub struct RunTraces {
    /// Where spans are begun.
    pub traces: Traces,
    /// What the runs are made for, such as a command.
    pub above: TraceParent,
}

impl std::fmt::Debug for RunTraces {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RunTraces").field("above", &self.above).finish_non_exhaustive()
    }
}

/// The spans of the leases that are open.
#[derive(Default)]
pub(super) struct Spans {
    pub(super) to: Option<RunTraces>,
    open: BTreeMap<Lease, Span>,
}

impl Spans {
    /// A job goes to a worker: what its run has as its parent.
    pub(super) fn begin(&mut self, lease: Lease, job: &Job, worker: &str) -> Option<String> {
        let RunTraces { traces, above } = self.to.as_ref()?;
        let about = [
            ("starlings.particle", i64::from(job.particle).into()),
            ("starlings.record", i64::from(job.record).into()),
            ("starlings.attempt", i64::from(lease.attempt).into()),
            ("starlings.worker", worker.to_owned().into()),
        ];
        let span = traces.begin("run", Some(above), about);
        let parent = span.parent().to_string();
        self.open.insert(lease, span);
        Some(parent)
    }

    /// A lease was answered.
    pub(super) fn end(&mut self, lease: &Lease, answer: &LeaseOutcome) {
        let Some(span) = self.open.remove(lease) else { return };
        match answer {
            LeaseOutcome::Ran(result) => span.end_with(result.as_ref().err()),
            LeaseOutcome::Withdrawn => span.end_with(Some(&"it was withdrawn")),
        }
    }

    /// A worker is gone, and its leases with it.
    pub(super) fn left(&mut self, worker: WorkerId, reason: &str) {
        let its = self.open.keys().filter(|lease| lease.epoch == worker.0).copied().collect::<Vec<_>>();
        for span in its.iter().filter_map(|lease| self.open.remove(lease)) {
            span.end_with(Some(&reason));
        }
    }
}
