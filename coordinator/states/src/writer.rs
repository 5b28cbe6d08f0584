//! Takes the pieces of a state one after the other. What is not finished leaves nothing.

use std::sync::Arc;

use bytes::Bytes;
use starlings_proto::convert::state::{ChunkId, chunk_values, n_chunks};
use starlings_proto::{StateNaming, digest};

use crate::shared::{Pieces, Shared};
use crate::{StateError, StoredState};

/// A state on its way into the store.
#[derive(Debug)]
pub struct StateWriter {
    store: Arc<Shared>,
    n_state: usize,
    names: Vec<ChunkId>,
    naming: StateNaming,
}

impl StateWriter {
    pub(crate) fn new(store: &Arc<Shared>, n_state: usize) -> Self {
        let store = Arc::clone(store);
        Self { store, n_state, names: Vec::new(), naming: StateNaming::of(n_state) }
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
        self.store.put(name, &bytes)?;
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
        self.take(name);
        Ok(())
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
        let id = self.naming.finish();
        let mut table = self.store.lock();
        if let Some(held) = table.named.get(&id).and_then(std::sync::Weak::upgrade) {
            // The drop of this writer gives its uses back.
            drop(table);
            return Ok(StoredState::of(held));
        }
        let names = std::mem::take(&mut self.names);
        let pieces = Arc::new(Pieces { store: Arc::clone(&self.store), id, n_state: self.n_state, names });
        table.named.insert(id, Arc::downgrade(&pieces));
        drop(table);
        Ok(StoredState::of(pieces))
    }
}

impl Drop for StateWriter {
    fn drop(&mut self) {
        self.store.release(&self.names);
    }
}
