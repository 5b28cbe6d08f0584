//! What is read of a fleet from outside.
//!
//! Next file to read: [`crate::tally`].

use super::Hub;
use crate::tally::Reading;

impl Hub {
    /// Where the fleet stands, and what it has done.
    pub(crate) fn read(&self) -> Reading {
        let state = self.lock();
        let mut tally = state.counting.tally.clone();
        tally.repeats = state.dispatcher.n_repeat();
        Reading { tally, census: state.dispatcher.census(), has_ended: state.stopped.is_some() }
    }
}
