//! What the caller of a batch is told: its outcomes, early ones and all of them, with their states.
//!
//! Next file to read: [`super::states`].

use super::Reply;
use super::state::State;
use crate::{Held, Outcome, wire};

impl State {
    pub(super) fn reply(&mut self, reply: Reply) {
        if let Some(running) = self.running.take() {
            // Who is told of an error asks for what had arrived.
            if reply.is_ok() {
                self.states.forget();
            }
            self.states.let_go_of(running.states);
            let _ = running.reply.send(reply);
        }
    }

    /// Outcomes that the caller of the batch was not told of before, of one that ended in an error too.
    pub(super) fn arrived(&mut self) -> Vec<(usize, Outcome<Held>)> {
        let arrived = self.dispatcher.arrived().into_iter();
        let held = |(index, outcome): (usize, wire::Outcome)| Some((index, self.states.held(outcome)?));
        // One whose state is gone is made again.
        let arrived = arrived.filter_map(held).collect();
        if self.running.is_none() {
            self.states.forget();
        }
        arrived
    }
}
