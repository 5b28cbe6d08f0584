//! What a store, its states and its writers share: the table of pieces and the folder.
//!
//! Files are written, put into their place and removed outside the lock of the table, which those who decide have to wait for. What
//! puts a file into its place and what removes one exclude each other by a lock of their own. In a folder that workers write into as well no piece is
//! removed while a run is on its way that may end in it: see [`Shared::tidy`]. Next file to read: `table`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use bytes::Bytes;
use starlings_pieces::Folder;
use starlings_proto::convert::state::ChunkId;
use starlings_proto::{MAX_INLINE_STATE, StateId};

use crate::StateError;
use crate::memory::{InMemory, Memory};
use crate::table::Table;

/// Files that are removed before others may come into their places.
const AT_ONCE: usize = 64;

/// What all clones and all states share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) memory: usize,
    pub(crate) folder: Mutex<Option<Arc<Folder>>>,
    pub(crate) table: Mutex<Table<Pieces>>,
    /// Held while files come into their places and go; taken before that of the table.
    pub(crate) files: Mutex<()>,
    /// Whether workers write into the folder and read from it.
    pub(crate) for_workers: bool,
    /// Whether workers of this machine take descriptors of memory.
    pub(crate) lends: AtomicBool,
}

/// The pieces of one state.
#[derive(Debug)]
pub(crate) struct Pieces {
    pub(crate) store: Arc<Shared>,
    pub(crate) id: StateId,
    pub(crate) n_state: usize,
    pub(crate) names: Vec<ChunkId>,
    /// Where all of it is one after the other.
    pub(crate) memory: Option<Arc<Memory>>,
}

impl Shared {
    pub(crate) fn lock(&self) -> MutexGuard<'_, Table<Pieces>> {
        lock(&self.table)
    }

    /// The folder; a temporary one where none was named.
    pub(crate) fn folder(&self) -> Result<Arc<Folder>, StateError> {
        let mut folder = lock(&self.folder);
        if let Some(folder) = &*folder {
            return Ok(Arc::clone(folder));
        }
        Ok(Arc::clone(folder.insert(Arc::new(Folder::temporary()?))))
    }

    /// Keeps a piece, or counts one more use of it.
    pub(crate) fn put(&self, name: ChunkId, bytes: &Bytes) -> Result<(), StateError> {
        {
            let mut table = self.lock();
            if table.again(&name) || table.remember(name, bytes, self.memory) {
                return Ok(());
            }
        }
        self.put_on_disk(name, bytes)
    }

    /// The same of bytes that stay the caller's: they are copied where no state has them.
    pub(crate) fn put_copy(&self, name: ChunkId, bytes: &[u8]) -> Result<(), StateError> {
        if self.lock().again(&name) {
            return Ok(());
        }
        if self.lock().in_memory().saturating_add(bytes.len()) > self.memory {
            return self.put_on_disk(name, bytes);
        }
        self.put(name, &Bytes::copy_from_slice(bytes))
    }

    fn put_on_disk(&self, name: ChunkId, bytes: &[u8]) -> Result<(), StateError> {
        let folder = self.folder()?;
        let written = folder.stage(bytes)?;
        let _files = lock(&self.files);
        if self.lock().again(&name) {
            return Ok(());
        }
        folder.place(written, &name)?;
        self.lock().on_disk(name);
        Ok(())
    }

    /// Memory for a whole state of so many values, to be lent or not, where there is room and somebody who takes descriptors.
    pub(crate) fn whole(&self, n_state: usize, is_lent: bool) -> Option<Memory> {
        let bytes = n_state.checked_mul(8).filter(|bytes| *bytes > MAX_INLINE_STATE)?;
        if !self.lends.load(Ordering::Relaxed) {
            return None;
        }
        let room = self.lock().room(bytes, self.memory, is_lent)?;
        Memory::new(room)
    }

    /// Counts one use of each of these pieces, which are in the memory of a whole state.
    pub(crate) fn put_within(&self, pieces: impl Iterator<Item = (ChunkId, InMemory)>) {
        let mut table = self.lock();
        pieces.for_each(|(name, held)| table.within(name, held));
    }

    /// Takes note of a piece that the folder has already.
    pub(crate) fn found(&self, name: ChunkId, bytes: usize) -> Result<(), StateError> {
        let _files = lock(&self.files);
        if !self.lock().again(&name) {
            self.folder()?.check(&name, bytes)?;
            self.lock().on_disk(name);
        }
        Ok(())
    }

    pub(crate) fn read(&self, name: &ChunkId) -> Result<Bytes, StateError> {
        let held = self.lock().chunks.get(name).and_then(|entry| entry.held.clone());
        held.map_or_else(|| Ok(self.folder()?.read(name)?), |held| held.read())
    }

    /// Whether reading a piece takes no file.
    pub(crate) fn is_in_memory(&self, name: &ChunkId) -> bool {
        self.lock().chunks.get(name).is_some_and(|entry| entry.held.is_some())
    }

    /// Makes sure that the folder has a piece that is held.
    pub(crate) fn persist(&self, name: &ChunkId) -> Result<(), StateError> {
        let held = match self.lock().chunks.get(name) {
            Some(entry) if !entry.on_disk => entry.held.clone(),
            _ => None,
        };
        let Some(held) = held else { return Ok(()) };
        let folder = self.folder()?;
        let written = folder.stage(&held.read()?)?;
        let _files = lock(&self.files);
        folder.place(written, name)?;
        self.lock().placed(name);
        Ok(())
    }

    /// Copies those of these pieces that others need out of the memory of a whole state, which would stay with any of them.
    pub(crate) fn move_out(&self, names: &[ChunkId], memory: &Arc<Memory>) {
        for name in names {
            let left = self.lock().left_within(name, memory);
            // One that cannot be read stays where it is.
            if let Some(Ok(bytes)) = left.map(|held| held.read()) {
                self.lock().moved_out(name, memory, bytes);
            }
        }
    }

    /// Gives up one use of each of these pieces, some of which may be in the memory of a whole state that goes with them.
    pub(crate) fn release(&self, names: &[ChunkId], memory: Option<&Arc<Memory>>) {
        let is_left = {
            let mut table = self.lock();
            for name in names {
                table.release(name);
            }
            table.has_unneeded()
        };
        if let Some(memory) = memory {
            self.move_out(names, memory);
        }
        if is_left && !self.for_workers {
            self.tidy();
        }
    }

    /// Removes what nobody needs from the folder. In one that workers write into that is done before the first run of a batch is given
    /// away: a worker that finds out later that its end state has such a piece writes it again.
    pub(crate) fn tidy(&self) {
        loop {
            let _files = lock(&self.files);
            let names = self.lock().unneeded(AT_ONCE);
            if names.is_empty() {
                return;
            }
            let Ok(folder) = self.folder() else { return };
            for name in &names {
                folder.remove(name);
            }
        }
    }
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Pieces {
    fn drop(&mut self) {
        {
            let mut table = self.store.lock();
            // Another one of this name may have come since the last holder of this one went.
            if table.named.get(&self.id).is_some_and(|held| std::ptr::eq(Weak::as_ptr(held), self)) {
                table.named.remove(&self.id);
            }
        }
        self.store.release(&self.names, self.memory.as_ref());
    }
}
