//! Which pieces there are, where each of them is and how many states need it.

use std::collections::{HashMap, HashSet};
use std::sync::Weak;

use bytes::Bytes;
use starlings_proto::StateId;
use starlings_proto::convert::state::ChunkId;

/// Guarded by the store's lock. A state is a `P`.
#[derive(Debug)]
pub(crate) struct Table<P> {
    pub(crate) chunks: HashMap<ChunkId, Entry>,
    /// States that somebody holds.
    pub(crate) named: HashMap<StateId, Weak<P>>,
    /// Bytes of the pieces in memory.
    pub(crate) in_memory: usize,
    /// Most of them at one time.
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
    pub(crate) bytes: Option<Bytes>,
    /// Whether the folder has it, and it goes with the last use.
    pub(crate) on_disk: bool,
}

impl<P> Default for Table<P> {
    fn default() -> Self {
        Self {
            chunks: HashMap::new(),
            named: HashMap::new(),
            in_memory: 0,
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

    /// Takes a piece that is not there into memory where the limit allows it.
    pub(crate) fn remember(&mut self, name: ChunkId, bytes: &Bytes, limit: usize) -> bool {
        if self.in_memory + bytes.len() > limit {
            return false;
        }
        self.in_memory += bytes.len();
        self.most = self.most.max(self.in_memory);
        self.chunks.insert(name, Entry { refs: 1, bytes: Some(bytes.clone()), on_disk: false });
        true
    }

    /// Counts one use of a piece that stands in the folder; it may have come into memory meanwhile.
    pub(crate) fn on_disk(&mut self, name: ChunkId) {
        let entry = self.chunks.entry(name).or_insert(Entry { refs: 0, bytes: None, on_disk: true });
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
        self.in_memory -= entry.bytes.as_ref().map_or(0, Bytes::len);
        if entry.on_disk {
            self.given_up.insert(*name);
        }
        self.chunks.remove(name);
    }
}
