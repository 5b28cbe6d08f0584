//! The store: pieces by name, in memory up to a limit, in the folder beyond it.
//!
//! When memory is full, what comes next goes to the folder: every piece is read once or twice and then dropped, so none is worth
//! more than another. Next files to read: `shared`, `stored`.

use std::collections::HashSet;
use std::path::Path;
use std::sync::{Arc, Mutex};

use starlings_proto::StateId;
use starlings_proto::convert::floats;
use starlings_proto::convert::state::{CHUNK_VALUES, ChunkId};

use crate::folder::Folder;
use crate::shared::{Shared, lock};
use crate::{StateError, StateWriter, StoredState, hex};

/// A store of states; clones are the same one.
#[derive(Clone, Debug)]
pub struct StateStore {
    shared: Arc<Shared>,
}

impl StateStore {
    /// Bytes in memory where nothing else is said: 1 GiB.
    pub const MEMORY: usize = 1 << 30;

    /// An empty store of up to so many bytes in memory; the rest goes to a temporary folder unless [`StateStore::settle`] says where.
    pub fn new(memory: usize) -> Self {
        let shared = Shared { memory, folder: Mutex::default(), table: Mutex::default() };
        Self { shared: Arc::new(shared) }
    }

    /// The store that holds a state.
    pub fn of(state: &StoredState) -> Self {
        Self { shared: Arc::clone(state.shared()) }
    }

    /// Says which folder to use from now on; `false` where pieces stand in another one.
    pub fn settle(&self, path: &Path) -> bool {
        let table = self.shared.lock();
        let mut folder = lock(&self.shared.folder);
        if folder.as_ref().is_some_and(|folder| folder.is_at(path)) {
            return true;
        }
        let free = !table.chunks.values().any(|entry| entry.on_disk);
        if free {
            *folder = Some(Arc::new(Folder::at(path)));
        }
        free
    }

    /// Begins a state of so many values.
    pub fn writer(&self, n_state: usize) -> StateWriter {
        StateWriter::new(&self.shared, n_state)
    }

    /// Keeps a state that is in memory.
    ///
    /// # Errors
    /// When memory is full and the folder refuses.
    pub fn keep(&self, values: &[f64]) -> Result<StoredState, StateError> {
        let mut writer = self.writer(values.len());
        for piece in values.chunks(CHUNK_VALUES) {
            writer.push(floats::encode(piece))?;
        }
        writer.finish()
    }

    /// A state that somebody holds.
    pub fn get(&self, id: &StateId) -> Option<StoredState> {
        let pieces = self.shared.lock().named.get(id)?.upgrade()?;
        Some(StoredState::of(pieces))
    }

    /// The state of so many values that an earlier process left in the folder with these pieces.
    ///
    /// # Errors
    /// When a piece is missing or has another length. What it holds is checked when it is read.
    pub fn reopen(&self, n_state: usize, pieces: &[ChunkId]) -> Result<StoredState, StateError> {
        let mut writer = self.writer(n_state);
        for name in pieces {
            writer.push_existing(*name)?;
        }
        writer.finish()
    }

    /// Removes what an earlier process left in the folder and no state needs.
    pub fn sweep(&self) {
        let table = self.shared.lock();
        let names: HashSet<String> = table.chunks.keys().map(hex).collect();
        self.shared.folder().keep_only(&names);
    }

    /// Removes the folder: nothing in it is needed any more.
    pub fn clear(&self) {
        if let Some(folder) = &*lock(&self.shared.folder) {
            folder.clear();
        }
    }

    /// Whether a piece of so many bytes goes into memory.
    pub fn has_room(&self, bytes: usize) -> bool {
        self.shared.lock().in_memory + bytes <= self.shared.memory
    }

    /// Bytes of the pieces in memory now, and most of them at one time.
    pub fn in_memory(&self) -> (usize, usize) {
        let table = self.shared.lock();
        (table.in_memory, table.most)
    }

    /// Number of different pieces.
    pub fn n_pieces(&self) -> usize {
        self.shared.lock().chunks.len()
    }
}
