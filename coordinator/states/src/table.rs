//! Which pieces there are, where each of them is and how many states need it.

use std::collections::{HashMap, HashSet};
use std::sync::{Arc, Weak};

use bytes::Bytes;
use starlings_proto::StateId;
use starlings_proto::convert::state::ChunkId;

use crate::memory::{InMemory, Memory, Room, Taken};

/// Guarded by the store's lock. A state is a `P`.
#[derive(Debug)]
pub(crate) struct Table<P> {
    pub(crate) chunks: HashMap<ChunkId, Entry>,
    /// States that somebody holds.
    pub(crate) named: HashMap<StateId, Weak<P>>,
    /// Bytes of the pieces that are in memory by themselves.
    alone: usize,
    /// What whole states take in memory.
    whole: Arc<Taken>,
    /// Most bytes in memory at one time.
    pub(crate) most: usize,
    /// Pieces that stand in the folder and were given up by their last state.
    given_up: HashSet<ChunkId>,
}

/// A piece.
#[derive(Debug)]
pub(crate) struct Entry {
    /// How many states, or places in one state, need it.
    refs: usize,
    /// Where it is in memory.
    pub(crate) held: Option<InMemory>,
    /// Whether the folder has it, and it goes with the last use.
    pub(crate) on_disk: bool,
}

impl<P> Default for Table<P> {
    fn default() -> Self {
        Self {
            chunks: HashMap::new(),
            named: HashMap::new(),
            alone: 0,
            whole: Arc::default(),
            most: 0,
            given_up: HashSet::new(),
        }
    }
}

impl<P> Table<P> {
    /// Counts one more use of a piece that is there.
    pub(crate) fn again(&mut self, name: &ChunkId) -> bool {
        let Some(entry) = self.chunks.get_mut(name) else { return false };
        entry.refs += 1;
        true
    }

    /// Bytes in memory.
    pub(crate) fn in_memory(&self) -> usize {
        self.alone + self.whole.bytes()
    }

    /// Takes a piece that is not there into memory where the limit allows it.
    pub(crate) fn remember(&mut self, name: ChunkId, bytes: &Bytes, limit: usize) -> bool {
        if self.in_memory() + bytes.len() > limit {
            return false;
        }
        self.alone += bytes.len();
        self.most = self.most.max(self.in_memory());
        let held = Some(InMemory::Alone(bytes.clone()));
        self.chunks.insert(name, Entry { refs: 1, held, on_disk: false });
        true
    }

    /// Room for a whole state of so many bytes where the limit allows it, to be lent or not.
    pub(crate) fn room(&mut self, bytes: usize, limit: usize, is_lent: bool) -> Option<Room> {
        if self.in_memory().saturating_add(bytes) > limit {
            return None;
        }
        let room = self.whole.take(bytes, limit, is_lent)?;
        self.most = self.most.max(self.in_memory());
        Some(room)
    }

    /// Counts one use of a piece that is in the memory of a whole state.
    pub(crate) fn within(&mut self, name: ChunkId, held: InMemory) {
        let entry = self.chunks.entry(name).or_insert(Entry { refs: 0, held: None, on_disk: false });
        entry.refs += 1;
        entry.held.get_or_insert(held);
    }

    /// Where a piece is that others need and that is in the memory of a state which goes.
    pub(crate) fn left_within(&self, name: &ChunkId, memory: &Arc<Memory>) -> Option<InMemory> {
        self.chunks.get(name)?.held.clone().filter(|held| held.is_within(memory))
    }

    /// Has a piece be in memory by itself that was in that of a whole state: it counts as much as there.
    pub(crate) fn moved_out(&mut self, name: &ChunkId, memory: &Arc<Memory>, bytes: Bytes) {
        let held = self.chunks.get_mut(name).and_then(|entry| entry.held.as_mut());
        if let Some(held) = held.filter(|held| held.is_within(memory)) {
            memory.uncount(bytes.len());
            self.alone += bytes.len();
            *held = InMemory::Alone(bytes);
        }
    }

    /// Counts one use of a piece that stands in the folder; it may have come into memory meanwhile.
    pub(crate) fn on_disk(&mut self, name: ChunkId) {
        let entry = self.chunks.entry(name).or_insert(Entry { refs: 0, held: None, on_disk: true });
        (entry.refs, entry.on_disk) = (entry.refs + 1, true);
        self.given_up.remove(&name);
    }

    /// Takes note that a piece stands in the folder too.
    pub(crate) fn placed(&mut self, name: &ChunkId) {
        if let Some(entry) = self.chunks.get_mut(name) {
            entry.on_disk = true;
            self.given_up.remove(name);
        }
    }

    /// Has the file of a piece stay when its last use is given up.
    pub(crate) fn leave(&mut self, name: &ChunkId) {
        if let Some(entry) = self.chunks.get_mut(name) {
            entry.on_disk = false;
        }
    }

    /// Whether pieces stand in the folder that no state needed when they were given up.
    pub(crate) fn has_unneeded(&self) -> bool {
        !self.given_up.is_empty()
    }

    /// Takes so many pieces that stand in the folder and are needed by no state.
    pub(crate) fn unneeded(&mut self, most: usize) -> Vec<ChunkId> {
        let names: Vec<ChunkId> = self.given_up.iter().take(most).copied().collect();
        for name in &names {
            self.given_up.remove(name);
        }
        names
    }

    /// Gives up one use of a piece; it goes with its last one, and its file with [`Table::unneeded`].
    pub(crate) fn release(&mut self, name: &ChunkId) {
        let Some(entry) = self.chunks.get_mut(name) else { return };
        entry.refs -= 1;
        if entry.refs > 0 {
            return;
        }
        self.alone -= entry.held.as_ref().map_or(0, InMemory::own_bytes);
        if entry.on_disk {
            self.given_up.insert(*name);
        }
        self.chunks.remove(name);
    }
}
