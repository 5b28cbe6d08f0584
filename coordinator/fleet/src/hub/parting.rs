//! How workers are asked to leave, and what they are told.
//!
//! Next file to read: [`super::telling`].

use starlings_proto::ToWorker;

use super::Hub;
use crate::event_kind::{BROKEN_OFF, OVER};

impl Hub {
    /// The run is not done, which workers are told in the end.
    pub(crate) fn break_off(&self) {
        self.lock().last_word = BROKEN_OFF;
    }

    /// What workers are told in the end.
    pub(crate) fn last_word(&self) -> &'static str {
        self.lock().last_word
    }

    /// Asks all workers to leave and takes no new ones.
    pub(crate) fn drain(&self, reason: &str) {
        let now = self.now();
        let mut state = self.lock();
        state.events.tell_rest(now);
        state.draining = true;
        for link in state.links.values() {
            link.outbox.send(ToWorker::drain(reason));
        }
    }

    /// Asks the workers with these process numbers to leave.
    pub(crate) fn dismiss(&self, pids: &[u32]) {
        for link in self.lock().links.values().filter(|link| pids.contains(&link.pid)) {
            link.outbox.send(ToWorker::drain(OVER));
        }
    }
}
