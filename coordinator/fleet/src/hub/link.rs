//! The way to one worker, with what it has been sent that later jobs name.

use starlings_proto::{JobEncoder, Lease, SentWindows, SetupId, ToWorker};

use crate::outbox::Outbox;
use crate::run_traces::Spans;
use crate::wire::Job;

/// The way to one worker.
pub(super) struct Link {
    pub(super) name: String,
    pub(super) outbox: Outbox,
    pub(super) pid: u32,
    pub(super) nonce: u64,
    /// Windows that were sent on it.
    pub(super) windows: SentWindows,
}

impl Link {
    pub(super) fn new(name: String, outbox: Outbox, pid: u32, nonce: u64) -> Self {
        Self { name, outbox, pid, nonce, windows: SentWindows::default() }
    }

    /// Has it run a job under a lease; where runs are traced, as a part of the span that begins with it.
    pub(super) fn give(
        &mut self,
        encoder: &mut JobEncoder,
        spans: &mut Spans,
        lease: Lease,
        (setup, job): &(SetupId, Job),
    ) {
        let parent = spans.begin(lease, job, &self.name);
        let (window, mut message) = encoder.encode(lease, setup, job, &mut self.windows);
        if let Some(parent) = parent {
            message = ToWorker::traced(message, parent);
        }
        for message in window.into_iter().chain([message]) {
            self.outbox.send(message);
        }
    }
}
