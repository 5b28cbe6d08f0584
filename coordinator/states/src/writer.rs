//! Takes the pieces of a state one after the other. What is not finished leaves nothing.

use std::sync::Arc;

use bytes::Bytes;
use starlings_proto::convert::state::{CHUNK_BYTES, ChunkId, chunk_values, n_chunks};
use starlings_proto::{StateNaming, digest};

use crate::memory::{InMemory, Memory};
use crate::shared::{Pieces, Shared};
use crate::{StateError, StoredState};

/// A state on its way into the store.
#[derive(Debug)]
pub struct StateWriter {
    store: Arc<Shared>,
    n_state: usize,
    names: Vec<ChunkId>,
    naming: StateNaming,
    /// Whether it goes to workers.
    for_workers: bool,
    /// The memory of all of it, where there is room for that.
    whole: Option<Arc<Memory>>,
}

impl StateWriter {
    pub(crate) fn new(store: &Arc<Shared>, n_state: usize, for_workers: bool) -> Self {
        let store = Arc::clone(store);
        let naming = StateNaming::of(n_state);
        Self { store, n_state, names: Vec::new(), naming, for_workers, whole: None }
    }

    /// Values that the next piece must have; zero when all are there.
    pub fn wanted(&self) -> usize {
        chunk_values(self.n_state, self.names.len())
    }

    /// Pieces that are not there yet.
    pub fn missing(&self) -> usize {
        n_chunks(self.n_state).saturating_sub(self.names.len())
    }

    /// Takes the next piece.
    ///
    /// # Errors
    /// When it has another length than the next piece must have, or memory is full and the folder refuses.
    pub fn push(&mut self, bytes: Bytes) -> Result<(), StateError> {
        let name = digest(&bytes);
        self.push_named(name, bytes)
    }

    /// Takes the next piece of which the name is known already.
    ///
    /// # Errors
    /// As [`StateWriter::push`].
    #[expect(clippy::needless_pass_by_value, reason = "a piece in memory shares its bytes with nobody else")]
    pub fn push_named(&mut self, name: ChunkId, bytes: Bytes) -> Result<(), StateError> {
        let wanted = self.wanted() * 8;
        if wanted == 0 || bytes.len() != wanted {
            return Err(self.misfit(bytes.len()));
        }
        if self.names.is_empty() && self.for_workers {
            self.whole = self.store.whole(self.n_state, false).map(Arc::new);
        }
        match &self.whole {
            Some(memory) => {
                let at = self.names.len() * CHUNK_BYTES;
                memory.write(&bytes, at)?;
                let piece = InMemory::Within(Arc::clone(memory), at, bytes.len());
                self.store.put_within(std::iter::once((name, piece)));
            }
            None => self.store.put(name, &bytes)?,
        }
        self.take(name);
        Ok(())
    }

    /// Takes the next piece, of which a copy is kept where no other state has it.
    ///
    /// # Errors
    /// As [`StateWriter::push`].
    pub fn push_copy(&mut self, bytes: &[u8]) -> Result<(), StateError> {
        let wanted = self.wanted() * 8;
        if wanted == 0 || bytes.len() != wanted {
            return Err(self.misfit(bytes.len()));
        }
        let name = digest(bytes);
        self.store.put_copy(name, bytes)?;
        self.is_whole_no_more();
        self.take(name);
        Ok(())
    }

    /// Takes as the next piece one that the folder has already.
    ///
    /// # Errors
    /// When it is not there or has another length than the next piece must have.
    pub fn push_existing(&mut self, name: ChunkId) -> Result<(), StateError> {
        let wanted = self.wanted() * 8;
        if wanted == 0 {
            return Err(self.misfit(0));
        }
        self.store.found(name, wanted)?;
        self.is_whole_no_more();
        self.take(name);
        Ok(())
    }

    /// The next piece is not in the memory of the whole, which is of no use then.
    fn is_whole_no_more(&mut self) {
        if let Some(memory) = self.whole.take() {
            self.store.move_out(&self.names, &memory);
        }
    }

    fn take(&mut self, name: ChunkId) {
        self.naming.piece(&name);
        self.names.push(name);
    }

    fn misfit(&self, bytes: usize) -> StateError {
        StateError::Pieces { n_state: self.n_state, index: self.names.len(), bytes }
    }

    /// The state, when all pieces are there.
    ///
    /// # Errors
    /// When some are missing.
    pub fn finish(mut self) -> Result<StoredState, StateError> {
        if self.names.len() != n_chunks(self.n_state) {
            return Err(self.misfit(0));
        }
        if let Some(memory) = &self.whole {
            memory.seal()?;
        }
        let (store, n_state, id) = (Arc::clone(&self.store), self.n_state, self.naming.finish());
        let memory = self.whole.take();
        let names = std::mem::take(&mut self.names);
        Ok(StoredState::named(Pieces { store, id, n_state, names, memory }))
    }
}

impl Drop for StateWriter {
    fn drop(&mut self) {
        self.store.release(&self.names, self.whole.as_ref());
    }
}
