//! What is read of a fleet from outside.
//!
//! Next file to read: [`crate::tally`].

use super::Hub;
use crate::run_traces::RunTraces;
use crate::tally::Reading;

impl Hub {
    /// Has spans of runs written from now on.
    pub(crate) fn trace(&self, to: Option<RunTraces>) {
        self.lock().spans.to = to;
    }

    /// Where the fleet stands, and what it has done.
    pub(crate) fn read(&self) -> Reading {
        let state = self.lock();
        let mut tally = state.counting.tally.clone();
        tally.repeats = state.dispatcher.n_repeat();
        Reading { tally, census: state.dispatcher.census(), has_ended: state.stopped.is_some() }
    }
}
