//! The store: pieces by name, in memory up to a limit, in the folder beyond it.
//!
//! When memory is full, what comes next goes to the folder: every piece is read once or twice and then dropped, so none is worth
//! more than another. Next files to read: `shared`, `stored`.

use std::collections::HashSet;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use starlings_pieces::{Folder, hex};
use starlings_proto::StateId;
use starlings_proto::convert::floats;
use starlings_proto::convert::state::{CHUNK_VALUES, ChunkId};

use crate::shared::{Shared, lock};
use crate::{Lent, StateError, StateWriter, StoredState};

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
        Self::with(memory, None, false)
    }

    /// An empty store in a folder that workers share: every piece stands there, and nothing is in memory.
    pub fn shared(folder: Folder) -> Self {
        Self::with(0, Some(Arc::new(folder)), true)
    }

    fn with(memory: usize, folder: Option<Arc<Folder>>, for_workers: bool) -> Self {
        let (table, files) = (Mutex::default(), Mutex::default());
        let lends = AtomicBool::new(false);
        let shared = Shared { memory, folder: Mutex::new(folder), table, files, for_workers, lends };
        Self { shared: Arc::new(shared) }
    }

    /// Whether workers may read pieces from the folder and write them there.
    pub fn is_shared(&self) -> bool {
        self.shared.for_workers
    }

    /// Keeps states that go to workers in memory from now on whose descriptors workers of this machine take, as far as there is room. A
    /// store in a folder that workers share stays as it is.
    pub fn lends(&self) {
        self.shared.lends.store(!self.is_shared(), Ordering::Relaxed);
    }

    /// Memory into which a worker writes states of so many values; `None` where there is no room for it, or nobody takes descriptors.
    pub fn lend(&self, n_state: usize) -> Option<Lent> {
        Lent::new(&self.shared, n_state)
    }

    /// Removes what nobody needs any more from a folder that workers share; before a batch of runs is given away.
    pub fn tidy(&self) {
        if self.is_shared() {
            self.shared.tidy();
        }
    }

    /// The store that holds a state.
    pub fn of(state: &StoredState) -> Self {
        Self { shared: Arc::clone(state.shared()) }
    }

    /// Says which folder to use from now on; `false` where pieces stand in another one. One that is shared stays what it is.
    pub fn settle(&self, path: &Path) -> bool {
        if self.is_shared() {
            return true;
        }
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
        StateWriter::new(&self.shared, n_state, false)
    }

    /// Begins a state of so many values that goes to workers: where these take descriptors, in memory that they see.
    pub fn writer_for_workers(&self, n_state: usize) -> StateWriter {
        StateWriter::new(&self.shared, n_state, true)
    }

    /// Keeps a state that is in memory.
    ///
    /// # Errors
    /// When memory is full and the folder refuses.
    pub fn keep(&self, values: &[f64]) -> Result<StoredState, StateError> {
        let mut writer = self.writer_for_workers(values.len());
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
        let _files = lock(&self.shared.files);
        let names: HashSet<String> = self.shared.lock().chunks.keys().map(hex).collect();
        if let Ok(folder) = self.shared.folder() {
            folder.keep_only(&names);
        }
    }

    /// Removes the folder: nothing in it is needed any more.
    pub fn clear(&self) {
        if let Some(folder) = &*lock(&self.shared.folder) {
            folder.clear();
        }
    }

    /// Whether a piece that somebody wrote into the folder is what its name says.
    ///
    /// # Errors
    /// When it is missing, damaged, or the folder refuses.
    pub fn verify(&self, name: &ChunkId) -> Result<(), StateError> {
        self.shared.read(name).map(drop)
    }

    /// Whether a piece of so many bytes goes into memory.
    pub fn has_room(&self, bytes: usize) -> bool {
        self.shared.lock().in_memory() + bytes <= self.shared.memory
    }

    /// Bytes of the pieces in memory now, and most of them at one time.
    pub fn in_memory(&self) -> (usize, usize) {
        let table = self.shared.lock();
        (table.in_memory(), table.most)
    }

    /// Number of different pieces.
    pub fn n_pieces(&self) -> usize {
        self.shared.lock().chunks.len()
    }
}
