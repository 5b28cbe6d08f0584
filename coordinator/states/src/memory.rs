//! Memory of whole states that workers of this machine see too, counted against the limit of the store.
//!
//! A state in it goes to a worker by its descriptor: nothing is copied on this side. Next files to read: `lent`, for what
//! comes; `starlings_pieces::memory`, for what a descriptor is of.

use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use bytes::Bytes;
use rustix::process::{Resource, getrlimit};
use starlings_pieces::{Mapped, SharedMemory};

use crate::StateError;

/// Of the descriptors that this process may have, the part that memory of states takes at most.
const SHARE: u64 = 4;

/// Of the memory for states, the part that is lent at most.
const LENT_SHARE: usize = 4;

/// What whole states take: bytes, those of them that are lent, and descriptors.
#[derive(Debug, Default)]
pub(crate) struct Taken {
    bytes: AtomicUsize,
    lent: AtomicUsize,
    descriptors: AtomicUsize,
}

impl Taken {
    pub(crate) fn bytes(&self) -> usize {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Whether the system gives one more descriptor, with some left for all else.
    fn has_descriptor(&self) -> bool {
        let most = getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX) / SHARE;
        (self.descriptors.load(Ordering::Relaxed) as u64) < most
    }

    /// Counts so many bytes, of a limit, until the room is dropped; whether they are free is known to the caller, who holds the table's
    /// lock.
    pub(crate) fn take(self: &Arc<Self>, bytes: usize, limit: usize, is_lent: bool) -> Option<Room> {
        let lent = if is_lent { bytes } else { 0 };
        let too_much = is_lent && self.lent.load(Ordering::Relaxed).saturating_add(lent) > limit / LENT_SHARE;
        if too_much || !self.has_descriptor() {
            return None;
        }
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
        self.lent.fetch_add(lent, Ordering::Relaxed);
        self.descriptors.fetch_add(1, Ordering::Relaxed);
        Some(Room { taken: Arc::clone(self), bytes: AtomicUsize::new(bytes), lent })
    }
}

/// Bytes that are counted until this is dropped.
#[derive(Debug)]
pub(crate) struct Room {
    taken: Arc<Taken>,
    bytes: AtomicUsize,
    lent: usize,
}

impl Drop for Room {
    fn drop(&mut self) {
        self.taken.bytes.fetch_sub(*self.bytes.get_mut(), Ordering::Relaxed);
        self.taken.lent.fetch_sub(self.lent, Ordering::Relaxed);
        self.taken.descriptors.fetch_sub(1, Ordering::Relaxed);
    }
}

/// The memory of one state.
#[derive(Debug)]
pub(crate) struct Memory {
    shared: SharedMemory,
    room: Room,
}

impl Memory {
    /// Memory in this room; `None` where the system gives none.
    pub(crate) fn new(room: Room) -> Option<Self> {
        Some(Self { shared: SharedMemory::of(room.bytes.load(Ordering::Relaxed)).ok()?, room })
    }

    /// Counts so many bytes of it no longer: they are counted elsewhere.
    pub(crate) fn uncount(&self, bytes: usize) {
        self.room.bytes.fetch_sub(bytes, Ordering::Relaxed);
        self.room.taken.bytes.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Its addresses, where the system has some left.
    pub(crate) fn map(&self) -> Option<Mapped> {
        self.shared.map().ok()
    }

    pub(crate) fn failed(what: &'static str) -> impl Fn(std::io::Error) -> StateError {
        move |source| StateError::Memory { what, source: Arc::new(source) }
    }

    pub(crate) fn write(&self, bytes: &[u8], at: usize) -> Result<(), StateError> {
        self.shared.write(bytes, at).map_err(Self::failed("write"))
    }

    pub(crate) fn read(&self, bytes: &mut [u8], at: usize) -> Result<(), StateError> {
        self.shared.read(bytes, at).map_err(Self::failed("read"))
    }

    pub(crate) fn seal(&self) -> Result<(), StateError> {
        self.shared.seal().map_err(Self::failed("seal"))
    }
}

impl AsFd for Memory {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.shared.as_fd()
    }
}

/// A piece in memory.
#[derive(Clone, Debug)]
pub(crate) enum InMemory {
    /// By itself.
    Alone(Bytes),
    /// In the memory of a whole state, so many bytes from this one on.
    Within(Arc<Memory>, usize, usize),
}

impl InMemory {
    /// Bytes that go with it.
    pub(crate) fn own_bytes(&self) -> usize {
        match self {
            Self::Alone(bytes) => bytes.len(),
            Self::Within(..) => 0,
        }
    }

    /// Whether it is in this memory of a whole state.
    pub(crate) fn is_within(&self, memory: &Arc<Memory>) -> bool {
        matches!(self, Self::Within(within, ..) if Arc::ptr_eq(within, memory))
    }

    pub(crate) fn read(&self) -> Result<Bytes, StateError> {
        match self {
            Self::Alone(bytes) => Ok(bytes.clone()),
            Self::Within(memory, at, n_bytes) => {
                let mut bytes = vec![0; *n_bytes];
                memory.read(&mut bytes, *at)?;
                Ok(bytes.into())
            }
        }
    }
}
