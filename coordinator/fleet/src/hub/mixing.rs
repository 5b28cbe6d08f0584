//! Blocks on their way between the caller who wants states mixed and the workers that share the folder.
//!
//! Next file to read: [`crate::recombination`], which is the caller.

use std::time::Instant;

use starlings_proto::Lease;
use starlings_proto::convert::state::ChunkId;

use super::Hub;
use super::blocks::Work;
use super::state::State;
use crate::FleetEvent;
use crate::dispatcher::{Event, WorkerId};

impl State {
    /// Gives blocks away to whoever has room.
    pub(super) fn give_blocks(&mut self) {
        while let Some((worker, message)) = self.blocks.give() {
            self.send(worker, message);
        }
    }
}

impl Hub {
    /// A worker has found the folder that is shared.
    pub(crate) fn shares_states(&self, worker: WorkerId) {
        let mut state = self.lock();
        // One that was put out speaks in vain.
        if !state.links.contains_key(&worker) || !self.store.is_shared() {
            return;
        }
        let Some(slots) = state.states.slots(worker) else { return };
        if state.blocks.joined(worker, slots) {
            let worker = state.name(worker);
            state.tell(FleetEvent::SharesStates { worker });
        }
        state.give_blocks();
    }

    /// Workers that share the folder.
    pub(crate) fn n_sharing(&self) -> usize {
        self.lock().blocks.n_sharing()
    }

    /// Has blocks made; every one of them is told of once, unless [`Hub::end_mixing`] comes before.
    pub(crate) fn begin_mixing(&self, work: Work) {
        let mut state = self.lock();
        state.blocks.begin(work);
        state.give_blocks();
    }

    /// What is still being made is of no use.
    pub(crate) fn end_mixing(&self) {
        self.lock().blocks.stop();
    }

    /// Takes back blocks that do not come.
    pub(crate) fn look_at_blocks(&self) {
        let mut state = self.lock();
        for worker in state.blocks.overdue(Instant::now()) {
            tracing::warn!(worker = state.name(worker), "it mixes no block that it was given");
        }
        state.give_blocks();
    }

    /// A worker answers for a block; one that it was not given, or has no more, is ignored.
    pub(crate) fn recombined(&self, worker: WorkerId, lease: Lease, made: Result<Vec<ChunkId>, String>) {
        self.handle(Event::Heard { worker });
        let mut state = self.lock();
        let own = Some(lease).filter(|lease| lease.epoch == worker.0 && state.links.contains_key(&worker));
        let block = own.and_then(|lease| state.blocks.answered(&lease, Instant::now()));
        let Some(block) = block else { return };
        let wanted = state.blocks.n_pieces();
        match made.and_then(|pieces| counted(pieces, wanted)) {
            Ok(pieces) => state.blocks.end(block, Ok((worker, pieces))),
            Err(reason) => {
                tracing::warn!(worker = state.name(worker), block, reason, "a block was not mixed");
                state.blocks.failed(worker, block);
            }
        }
        state.give_blocks();
    }

    /// Puts a worker out that mixes otherwise than this process does.
    pub(crate) fn mixes_wrong(&self, worker: WorkerId, reason: String) {
        let now = self.now();
        let mut state = self.lock();
        let (worker_name, (build, earlier)) = (state.name(worker), state.dispatcher.taken(worker));
        state.put_out(worker, &reason);
        state.blocks.left(worker);
        let excluded = FleetEvent::WorkerExcluded {
            worker: worker_name,
            build,
            reason: reason.clone(),
            again: 0,
            earlier,
        };
        state.tell(excluded);
        // Its stream may stay open for as long as it likes.
        state.handle(now, Event::Left { worker, reason, clean: true });
    }
}

/// As many pieces as a block has.
fn counted(pieces: Vec<ChunkId>, wanted: usize) -> Result<Vec<ChunkId>, String> {
    if pieces.len() == wanted {
        return Ok(pieces);
    }
    Err(format!("it names {} pieces where {wanted} belong", pieces.len()))
}
