//! Large states of a batch: who may send and ask for them, and for how long they are held.
//!
//! What is held no longer is dropped after the hub's lock ([`super::locked`]).
//!
//! A state that a worker put is held under its lease until the answer that names it, then for as long as the run's outcome is of that
//! answer, until the caller has it: what came of a repeated run, or of the loser of a race, goes with its answer. Those of jobs are held by their batch, or by the copy of a job that is kept for control runs. Next file to read: `transfers`.

use std::collections::BTreeMap;
use std::sync::Arc;

use starlings_proto::{Lease, State as Travelling, StateId};
use starlings_states::{Held, Lent, StateStore, StoredState};
use tonic::Status;

use crate::dispatcher::{ControlId, WorkerId};
use crate::{Outcome, wire};

/// Transfers of one worker at the same time, beyond one for each of its slots.
const SPARE_TRANSFERS: usize = 8;

/// Guarded by the hub's lock.
pub(super) struct States {
    pub(super) store: StateStore,
    sessions: BTreeMap<WorkerId, Session>,
    /// Put and not yet named by an answer.
    put: BTreeMap<Lease, StoredState>,
    /// Named by answers of the running batch.
    answered: BTreeMap<StateId, StoredState>,
    /// Of jobs that are kept for control runs.
    kept: BTreeMap<ControlId, StoredState>,
    /// Memory that workers write end states into, by its number.
    lent: BTreeMap<(WorkerId, u64), Arc<Lent>>,
    /// Held no longer.
    gone: Vec<StoredState>,
    lent_gone: Vec<Arc<Lent>>,
}

/// A worker that may transfer states.
pub(super) struct Session {
    nonce: u64,
    transfers: usize,
    most: usize,
}

impl States {
    pub(super) fn new(store: StateStore) -> Self {
        Self {
            store,
            sessions: BTreeMap::new(),
            put: BTreeMap::new(),
            answered: BTreeMap::new(),
            kept: BTreeMap::new(),
            lent: BTreeMap::new(),
            gone: Vec::new(),
            lent_gone: Vec::new(),
        }
    }

    pub(super) fn joined(&mut self, worker: WorkerId, nonce: u64, slots: u32) {
        let most = slots as usize + SPARE_TRANSFERS;
        self.sessions.insert(worker, Session { nonce, transfers: 0, most });
    }

    /// Jobs that a worker runs at the same time.
    pub(super) fn slots(&self, worker: WorkerId) -> Option<usize> {
        Some(self.sessions.get(&worker)?.most - SPARE_TRANSFERS)
    }

    /// A worker is gone, and what it put and did not name.
    pub(super) fn left(&mut self, worker: WorkerId) {
        self.sessions.remove(&worker);
        let put = std::mem::take(&mut self.put).into_iter();
        let (its, others): (BTreeMap<_, _>, _) = put.partition(|(lease, _)| lease.epoch == worker.0);
        self.put = others;
        self.gone.extend(its.into_values());
        self.take_back(|of, _| of == worker);
    }

    /// Takes back memory that was lent.
    fn take_back(&mut self, is_it: impl Fn(WorkerId, &Lent) -> bool) {
        let lent = std::mem::take(&mut self.lent).into_iter();
        let (its, others): (BTreeMap<_, _>, _) = lent.partition(|((of, _), lent)| is_it(*of, lent));
        self.lent = others;
        self.lent_gone.extend(its.into_values());
    }

    /// A batch is over, or another one begins: nothing of the earlier one is named any more.
    pub(super) fn forget(&mut self) {
        self.gone.extend(std::mem::take(&mut self.put).into_values());
        self.gone.extend(std::mem::take(&mut self.answered).into_values());
    }

    /// What is held no longer, to be dropped after the lock.
    pub(super) fn gone(&mut self) -> (Vec<StoredState>, Vec<Arc<Lent>>) {
        (std::mem::take(&mut self.gone), std::mem::take(&mut self.lent_gone))
    }

    /// Whether a worker may be lent memory for states of so many values: one for each of its slots. What it has for states of
    /// another length is taken back.
    pub(super) fn may_borrow(&mut self, worker: WorkerId, n_state: usize) -> bool {
        self.take_back(|of, lent| of == worker && lent.n_state() != n_state);
        let has = self.lent.range((worker, 0)..=(worker, u64::MAX)).count();
        self.slots(worker).is_some_and(|slots| has < slots)
    }

    /// Holds memory that a worker is lent under a number.
    pub(super) fn lend(&mut self, worker: WorkerId, number: u64, lent: Lent) {
        self.lent_gone.extend(self.lent.insert((worker, number), Arc::new(lent)));
    }

    /// Takes back the memory that a worker was lent under a number.
    pub(super) fn give_back(&mut self, worker: WorkerId, number: u64) {
        self.lent_gone.extend(self.lent.remove(&(worker, number)));
    }

    /// The memory that a worker was lent under a number.
    pub(super) fn lent(&self, worker: WorkerId, number: u64) -> Option<Arc<Lent>> {
        self.lent.get(&(worker, number)).cloned()
    }

    /// Drops states after the lock.
    pub(super) fn let_go_of(&mut self, states: impl IntoIterator<Item = StoredState>) {
        self.gone.extend(states);
    }

    /// Holds a state that arrived, in the place of one before under this lease.
    pub(super) fn arrived(&mut self, lease: Lease, state: StoredState) {
        self.gone.extend(self.put.insert(lease, state));
    }

    /// Counts one transfer less.
    pub(super) fn ended(&mut self, worker: WorkerId) {
        if let Some(session) = self.sessions.get_mut(&worker) {
            session.transfers -= 1;
        }
    }

    /// Holds the state of a job that is kept for control runs.
    pub(super) fn keep(&mut self, control: ControlId, job: &wire::Job) {
        if let Some(Travelling::Named(id)) = &job.state {
            let before = self.store.get(id).and_then(|state| self.kept.insert(control, state));
            self.gone.extend(before);
        }
    }

    pub(super) fn forget_kept(&mut self, control: ControlId) {
        self.gone.extend(self.kept.remove(&control));
    }

    /// The state that was put under a lease and is not yet named.
    pub(super) fn take(&mut self, lease: &Lease) -> Option<StoredState> {
        self.put.remove(lease)
    }

    /// Holds a state that an answer names, until the caller has it.
    pub(super) fn hold(&mut self, named: Option<StoredState>) {
        self.gone.extend(named.and_then(|state| self.answered.insert(state.id(), state)));
    }

    /// Holds a state no longer that an answer named.
    pub(super) fn let_go(&mut self, id: &StateId) {
        self.gone.extend(self.answered.remove(id));
    }

    /// Holds only those of the states that answers named.
    pub(super) fn keep_needed(&mut self, is_needed: impl Fn(&StateId) -> bool) {
        let answered = std::mem::take(&mut self.answered).into_iter();
        let (needed, others): (_, BTreeMap<_, _>) = answered.partition(|(id, _)| is_needed(id));
        self.answered = needed;
        self.gone.extend(others.into_values());
    }

    /// An outcome with its state, unless that is gone.
    pub(super) fn held(&self, outcome: wire::Outcome) -> Option<Outcome<Held>> {
        let held = |state| match state {
            Travelling::Values(values) => Ok(Held::Values(values)),
            Travelling::Named(id) => self.answered.get(&id).cloned().map(Held::Stored).ok_or(()),
        };
        outcome.try_map(held).ok()
    }

    /// The session of a worker, if the nonce is its own.
    pub(super) fn session(&mut self, worker: WorkerId, nonce: u64) -> Result<&mut Session, Status> {
        let session = self.sessions.get_mut(&worker).filter(|session| session.nonce == nonce);
        session.ok_or_else(|| Status::permission_denied("no worker with this session is connected"))
    }

    /// Counts one more transfer of a worker.
    pub(super) fn count(&mut self, worker: WorkerId, nonce: u64) -> Result<(), Status> {
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
