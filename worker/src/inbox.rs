//! Jobs that wait for their states: a state is asked for as soon as there is room for it, while other jobs compute.
//!
//! A job whose state came inside its message goes to the slots at once. Next file to read: `slots`.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use starlings_models::{Forward, Job, ParticleError, StateValues};
use starlings_proto::{Lease, LeaseOutcome, SetupId, State, StateId, job_key};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::AbortHandle;

use crate::outbox::Outbox;
use crate::slots::{Asked, Slots, Task};
use crate::transfer::Transfers;

/// States that are on their way at the same time: one is decoded while the next one crosses the network.
const LANES: usize = 2;

/// Memory for states of jobs that have not started, KiB per slot; a state that is larger has all of it.
const ROOM: u32 = 64 * 1024;

/// The jobs of one session that wait for their states.
pub(crate) struct Inbox {
    transfers: Transfers,
    lanes: Arc<Semaphore>,
    room: Arc<Semaphore>,
    most: u32,
    waiting: Arc<Mutex<BTreeMap<Lease, AbortHandle>>>,
}

impl Inbox {
    /// An empty one for so many slots.
    pub(crate) fn new(transfers: Transfers, slots: usize) -> Self {
        let most = ROOM.saturating_mul(slots.max(1) as u32).min(Semaphore::MAX_PERMITS as u32);
        Self {
            transfers,
            lanes: Arc::new(Semaphore::new(LANES)),
            room: Arc::new(Semaphore::new(most as usize)),
            most,
            waiting: Arc::default(),
        }
    }

    /// Who wants the answer to a job of this session.
    pub(crate) fn asked(&self, lease: Lease, outbox: &Outbox) -> Asked {
        Asked { lease, outbox: outbox.clone(), transfers: self.transfers.clone(), traced: None }
    }

    /// Brings a job to the slots, with its state.
    pub(crate) fn take(
        &self,
        slots: &Slots,
        asked: Asked,
        setup: SetupId,
        forward: Arc<dyn Forward>,
        job: Job<State>,
    ) {
        let named = if let Some(State::Named(id)) = &job.state { Some(*id) } else { None };
        let key = named.map(|_| job_key(&setup, &job));
        let state = if let Some(State::Values(values)) = job.state { Some(values.into()) } else { None };
        let Job { particle, record, window, theta, .. } = job;
        let job = Job { particle, record, window, theta, state };
        match (named, key) {
            (Some(id), Some(key)) => self.fetch(slots, asked, id, move |asked, state, room| {
                let job = Job { state: Some(state), ..job };
                Task::large(asked, setup, forward, job, key, room)
            }),
            _ => slots.push(Task::new(asked, setup, forward, job)),
        }
    }

    fn fetch(
        &self,
        slots: &Slots,
        asked: Asked,
        id: StateId,
        task: impl FnOnce(Asked, StateValues, OwnedSemaphorePermit) -> Task + Send + 'static,
    ) {
        let (slots, lease) = (slots.clone(), asked.lease);
        let (lanes, room, most) = (Arc::clone(&self.lanes), Arc::clone(&self.room), self.most);
        let waiting = Arc::clone(&self.waiting);
        let fetching = tokio::spawn(async move {
            let fetched = fetch(&asked.transfers, &room, &lanes, most, id).await;
            lock(&waiting).remove(&lease);
            match fetched {
                Ok((state, room)) => slots.push(task(asked, state, room)),
                Err(reason) => {
                    let failed = LeaseOutcome::Ran(Err(ParticleError::Infrastructure(reason)));
                    asked.outbox.answer(lease, failed, 0.0);
                }
            }
        });
        lock(&self.waiting).insert(lease, fetching.abort_handle());
    }

    /// Answers the given leases as withdrawn where their states have not arrived.
    pub(crate) fn withdraw(&self, leases: &[Lease], outbox: &Outbox) {
        for lease in leases {
            let waiting = lock(&self.waiting).remove(lease);
            if let Some(fetching) = waiting {
                fetching.abort();
                outbox.answer(*lease, LeaseOutcome::Withdrawn, 0.0);
            }
        }
    }

    /// Jobs that wait for their states.
    pub(crate) fn len(&self) -> usize {
        lock(&self.waiting).len()
    }
}

/// A state, with the room that it takes until its job starts.
async fn fetch(
    transfers: &Transfers,
    room: &Arc<Semaphore>,
    lanes: &Semaphore,
    most: u32,
    id: StateId,
) -> Result<(StateValues, OwnedSemaphorePermit), String> {
    let ends = |_| "this worker ends".to_owned();
    let _lane = lanes.acquire().await.map_err(ends)?;
    let incoming = transfers.ask(id).await?;
    let kib = u32::try_from(incoming.n_state.div_ceil(128)).unwrap_or(u32::MAX).min(most);
    let room = Arc::clone(room).acquire_many_owned(kib).await.map_err(ends)?;
    Ok((incoming.read().await?, room))
}

impl Drop for Inbox {
    fn drop(&mut self) {
        self.transfers.end();
        lock(&self.waiting).values().for_each(AbortHandle::abort);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
