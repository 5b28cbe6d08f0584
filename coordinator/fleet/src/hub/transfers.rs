//! Whether a worker may send or ask for a state now.
//!
//! Next file to read: [`crate::transfer`], which carries the pieces.

use std::sync::Arc;

use starlings_proto::MAX_INLINE_STATE;
use starlings_proto::convert::lent::{GiveBack, Lend};
use starlings_proto::convert::state::{Get, PutHead};
use starlings_states::{Lent, StateStore, StoredState};
use tonic::Status;

use super::Hub;
use super::state::State;
use crate::dispatcher::{BatchError, Event, WorkerId};

/// Largest state, in values, where nobody knows how many the model has: 1 GiB.
const UNKNOWN: usize = (1 << 30) / 8;

/// A transfer that is counted until it ends.
pub(crate) struct Counted {
    hub: Arc<Hub>,
    worker: WorkerId,
    /// Bytes that came and went.
    came: u64,
    went: u64,
}

impl Counted {
    fn new(hub: &Arc<Hub>, worker: WorkerId) -> Self {
        Self { hub: Arc::clone(hub), worker, came: 0, went: 0 }
    }

    /// So many bytes came from the worker.
    pub(crate) fn came(&mut self, bytes: usize) {
        self.came += bytes as u64;
    }

    /// So many bytes went to the worker.
    pub(crate) fn went(&mut self, bytes: usize) {
        self.went += bytes as u64;
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        let mut state = self.hub.lock();
        state.states.ended(self.worker);
        state.counting.tally.state_bytes_in += self.came;
        state.counting.tally.state_bytes_out += self.went;
    }
}

impl State {
    /// Whether a lease is open and its run may end in a state of so many values.
    fn may_put(&self, head: &PutHead) -> Result<(), Status> {
        let asked = self.asked(&head.lease).filter(|_| self.dispatcher.holds(&head.lease));
        let (setup, _) = asked.ok_or_else(|| Status::failed_precondition("nobody waits for this run"))?;
        let n_state = head.n_state;
        let fits = match self.shapes.get(setup).and_then(|shape| shape.n_state) {
            Some(wanted) if wanted != n_state => {
                Err(format!("a state of {n_state} values where {wanted} belong"))
            }
            None if n_state > UNKNOWN => {
                Err(format!("a state of {n_state} values, at most {UNKNOWN} are taken"))
            }
            _ if n_state * 8 <= MAX_INLINE_STATE => Err("a small state belongs into its result".to_owned()),
            _ => Ok(()),
        };
        fits.map_err(Status::invalid_argument)
    }
}

impl Hub {
    /// Where states are kept.
    pub(crate) fn states(&self) -> &StateStore {
        &self.store
    }

    /// Whether a worker may put a state now.
    pub(crate) fn begin_put(self: &Arc<Self>, head: &PutHead) -> Result<Counted, Status> {
        let worker = WorkerId(head.lease.epoch);
        let mut state = self.lock();
        state.states.session(worker, head.nonce)?;
        state.may_put(head)?;
        state.states.count(worker, head.nonce)?;
        Ok(Counted::new(self, worker))
    }

    /// Lends memory for end states to a worker, which `give` sends the descriptor; whether it did.
    pub(crate) fn lend(&self, lend: &Lend, give: impl FnOnce(&Lent) -> bool) -> Result<bool, Status> {
        let Lend { head, descriptor } = lend;
        let worker = WorkerId(head.lease.epoch);
        self.may_put(head)?;
        if !self.lock().states.may_borrow(worker, head.n_state) {
            return Ok(false);
        }
        let Some(lent) = self.store.lend(head.n_state).filter(give) else { return Ok(false) };
        let mut state = self.lock();
        state.states.session(worker, head.nonce)?;
        state.states.lend(worker, *descriptor, lent);
        Ok(true)
    }

    /// Takes back memory that was lent to a worker, if it was.
    pub(crate) fn give_back(&self, back: &GiveBack) -> Result<(), Status> {
        let (worker, mut state) = (WorkerId(back.epoch), self.lock());
        state.states.session(worker, back.nonce)?;
        state.states.give_back(worker, back.descriptor);
        Ok(())
    }

    /// The memory that was lent to the worker of a run under a number.
    pub(crate) fn lent(&self, head: &PutHead, number: u64) -> Option<Arc<Lent>> {
        self.lock().states.lent(WorkerId(head.lease.epoch), number)
    }

    fn may_put(&self, head: &PutHead) -> Result<(), Status> {
        let mut state = self.lock();
        state.states.session(WorkerId(head.lease.epoch), head.nonce)?;
        state.may_put(head)
    }

    /// Holds a state that arrived until the answer that names it.
    pub(crate) fn end_put(&self, head: &PutHead, arrived: StoredState) -> Result<(), Status> {
        let mut state = self.lock();
        state.states.session(WorkerId(head.lease.epoch), head.nonce)?;
        state.may_put(head)?;
        state.states.arrived(head.lease, arrived);
        Ok(())
    }

    /// The state that a worker asks for.
    pub(crate) fn begin_get(self: &Arc<Self>, get: &Get) -> Result<(StoredState, Counted), Status> {
        let worker = WorkerId(get.epoch);
        let mut state = self.lock();
        state.states.session(worker, get.nonce)?;
        let found = state.states.store.get(&get.state);
        let found = found.ok_or_else(|| Status::not_found("nobody holds a state of this name"))?;
        state.states.count(worker, get.nonce)?;
        drop(state);
        Ok((found, Counted::new(self, worker)))
    }

    /// A state cannot be kept or read here: the batch ends.
    pub(crate) fn state_lost(&self, reason: String) {
        self.handle(Event::Abort(BatchError::State(reason)));
    }
}
