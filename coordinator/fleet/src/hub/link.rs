//! The way to one worker, with what it has been sent that later jobs name.

use starlings_proto::{JobEncoder, Lease, SentWindows, SetupId};

use crate::outbox::Outbox;
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

    /// Has it run a job under a lease.
    pub(super) fn give(&mut self, encoder: &mut JobEncoder, lease: Lease, (setup, job): &(SetupId, Job)) {
        let (window, job) = encoder.encode(lease, setup, job, &mut self.windows);
        for message in window.into_iter().chain([job]) {
            self.outbox.send(message);
        }
    }
}
