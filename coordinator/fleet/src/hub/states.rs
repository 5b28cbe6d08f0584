//! Large states of a batch: who may send and ask for them, and for how long they are held.
//!
//! A state that a worker put is held under its lease until the answer that names it, then until the caller has the outcomes; those of
//! jobs are held by their batch, or by the copy of a job that is kept for control runs. Next file to read: [`crate::transfer`].

use std::collections::BTreeMap;
use std::sync::Arc;

use starlings_proto::convert::state::{Get, PutHead};
use starlings_proto::{Lease, MAX_INLINE_STATE, State as Travelling};
use starlings_states::{Held, StateStore, StoredState};
use tonic::Status;

use super::Hub;
use super::state::State;
use crate::dispatcher::{BatchError, ControlId, Event, WorkerId};
use crate::{Outcome, wire};

/// Transfers of one worker at the same time, beyond one for each of its slots.
const SPARE_TRANSFERS: usize = 8;

/// Largest state, in values, where nobody knows how many the model has: 1 GiB.
const UNKNOWN: usize = (1 << 30) / 8;

/// Guarded by the hub's lock.
pub(super) struct States {
    pub(super) store: StateStore,
    sessions: BTreeMap<WorkerId, Session>,
    /// Put and not yet named by an answer.
    put: BTreeMap<Lease, StoredState>,
    /// Named by answers of the running batch.
    answered: Vec<StoredState>,
    /// Of jobs that are kept for control runs.
    kept: BTreeMap<ControlId, StoredState>,
}

/// A worker that may transfer states.
struct Session {
    nonce: u64,
    transfers: usize,
    most: usize,
}

/// A transfer that is counted until it ends.
pub(crate) struct Counted {
    hub: Arc<Hub>,
    worker: WorkerId,
}

impl Drop for Counted {
    fn drop(&mut self) {
        if let Some(session) = self.hub.lock().states.sessions.get_mut(&self.worker) {
            session.transfers -= 1;
        }
    }
}

impl States {
    pub(super) fn new(store: StateStore) -> Self {
        Self {
            store,
            sessions: BTreeMap::new(),
            put: BTreeMap::new(),
            answered: Vec::new(),
            kept: BTreeMap::new(),
        }
    }

    pub(super) fn joined(&mut self, worker: WorkerId, nonce: u64, slots: u32) {
        let most = slots as usize + SPARE_TRANSFERS;
        self.sessions.insert(worker, Session { nonce, transfers: 0, most });
    }

    /// A worker is gone, and what it put and did not name.
    pub(super) fn left(&mut self, worker: WorkerId) {
        self.sessions.remove(&worker);
        self.put.retain(|lease, _| lease.epoch != worker.0);
    }

    /// A batch is over, or another one begins: nothing of the earlier one is named any more.
    pub(super) fn forget(&mut self) {
        self.put.clear();
        self.answered.clear();
    }

    /// Holds the state of a job that is kept for control runs.
    pub(super) fn keep(&mut self, control: ControlId, job: &wire::Job) {
        if let Some(Travelling::Named(id)) = &job.state {
            self.kept.extend(self.store.get(id).map(|state| (control, state)));
        }
    }

    pub(super) fn forget_kept(&mut self, control: ControlId) {
        self.kept.remove(&control);
    }

    /// The state that was put under a lease and is not yet named.
    pub(super) fn take(&mut self, lease: &Lease) -> Option<StoredState> {
        self.put.remove(lease)
    }

    /// Holds a state that an answer names, until the caller has it.
    pub(super) fn hold(&mut self, named: Option<StoredState>) {
        self.answered.extend(named);
    }

    /// The outcomes with their states.
    pub(super) fn held(&self, outcomes: Vec<wire::Outcome>) -> Result<Vec<Outcome<Held>>, BatchError> {
        let lost = || BatchError::State("the state of a run that had ended is gone".to_owned());
        let held = |state| match state {
            Travelling::Values(values) => Ok(Held::Values(values)),
            Travelling::Named(id) => self.store.get(&id).map(Held::Stored).ok_or_else(lost),
        };
        outcomes.into_iter().map(|outcome| outcome.try_map(held)).collect()
    }

    fn session(&mut self, worker: WorkerId, nonce: u64) -> Result<&mut Session, Status> {
        let session = self.sessions.get_mut(&worker).filter(|session| session.nonce == nonce);
        session.ok_or_else(|| Status::permission_denied("no worker with this session is connected"))
    }

    fn count(&mut self, worker: WorkerId, nonce: u64) -> Result<(), Status> {
        let session = self.session(worker, nonce)?;
        if session.transfers == session.most {
            return Err(Status::resource_exhausted(format!(
                "{} states are on their way already",
                session.most
            )));
        }
        session.transfers += 1;
        Ok(())
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
        Ok(Counted { hub: Arc::clone(self), worker })
    }

    /// Holds a state that arrived until the answer that names it.
    pub(crate) fn end_put(&self, head: &PutHead, arrived: StoredState) -> Result<(), Status> {
        let mut state = self.lock();
        state.states.session(WorkerId(head.lease.epoch), head.nonce)?;
        state.may_put(head)?;
        let before = state.states.put.insert(head.lease, arrived);
        drop(state);
        // Its files go outside the lock.
        drop(before);
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
        Ok((found, Counted { hub: Arc::clone(self), worker }))
    }

    /// A state cannot be kept or read here: the batch ends.
    pub(crate) fn state_lost(&self, reason: String) {
        self.handle(Event::Abort(BatchError::State(reason)));
    }
}
