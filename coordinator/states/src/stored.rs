//! A state that the store holds: its pieces stay for as long as somebody has it.

use std::os::fd::{AsFd, BorrowedFd};
use std::sync::{Arc, Weak};

use bytes::Bytes;
use starlings_proto::StateId;
use starlings_proto::convert::state::{CHUNK_VALUES, ChunkId};

use crate::StateError;
use crate::shared::{Pieces, Shared};

/// A state in the store; clones are the same one, and the last one takes its pieces with it.
#[derive(Clone, Debug)]
pub struct StoredState(Arc<Pieces>);

impl PartialEq for StoredState {
    fn eq(&self, other: &Self) -> bool {
        self.0.id == other.0.id
    }
}

impl StoredState {
    pub(crate) fn of(pieces: Arc<Pieces>) -> Self {
        Self(pieces)
    }

    /// The state of these pieces, of which each is used once for it, or the one that somebody holds under its name.
    pub(crate) fn named(pieces: Pieces) -> Self {
        let store = Arc::clone(&pieces.store);
        let mut table = store.lock();
        let held = table.named.get(&pieces.id).and_then(Weak::upgrade);
        if held.is_none() {
            let pieces = Arc::new(pieces);
            table.named.insert(pieces.id, Arc::downgrade(&pieces));
            return Self(pieces);
        }
        drop(table);
        // Its uses are given back.
        drop(pieces);
        held.map_or_else(|| unreachable!("it was found"), Self)
    }

    /// The descriptor of the memory that it is in as a whole.
    pub fn descriptor(&self) -> Option<BorrowedFd<'_>> {
        self.0.memory.as_deref().map(AsFd::as_fd)
    }

    /// Its name.
    pub fn id(&self) -> StateId {
        self.0.id
    }

    /// Number of its values.
    pub fn n_state(&self) -> usize {
        self.0.n_state
    }

    /// What holds it.
    pub(crate) fn shared(&self) -> &Arc<Shared> {
        &self.0.store
    }

    /// The names of its pieces, in their order.
    pub fn pieces(&self) -> &[ChunkId] {
        &self.0.names
    }

    /// The bytes of a piece.
    ///
    /// # Errors
    /// When the piece stands in the folder and is missing or damaged.
    ///
    /// # Panics
    /// When there is no such piece.
    pub fn piece(&self, index: usize) -> Result<Bytes, StateError> {
        self.0.store.read(&self.0.names[index])
    }

    /// Whether a piece can be read without a file.
    ///
    /// # Panics
    /// When there is no such piece.
    pub fn is_in_memory(&self, index: usize) -> bool {
        self.0.store.is_in_memory(&self.0.names[index])
    }

    /// Whether to drop its last clone takes time: pieces of it stand in the folder, or the system takes memory back.
    pub fn goes_slowly(&self) -> bool {
        if self.0.memory.is_some() {
            return true;
        }
        let table = self.0.store.lock();
        self.0.names.iter().any(|name| table.chunks.get(name).is_some_and(|entry| entry.on_disk))
    }

    /// Writes the values of a piece into a slice of their number.
    ///
    /// # Errors
    /// As [`StoredState::piece`].
    ///
    /// # Panics
    /// When there is no such piece, or the slice has another length.
    pub fn read(&self, index: usize, values: &mut [f64]) -> Result<(), StateError> {
        let bytes = self.piece(index)?;
        let (words, rest) = bytes.as_chunks::<8>();
        assert!(rest.is_empty() && words.len() == values.len(), "a piece of another length");
        for (value, word) in values.iter_mut().zip(words) {
            *value = f64::from_le_bytes(*word);
        }
        Ok(())
    }

    /// All its values.
    ///
    /// # Errors
    /// As [`StoredState::piece`].
    pub fn values(&self) -> Result<Vec<f64>, StateError> {
        let mut values = vec![0.0; self.n_state()];
        for (index, piece) in values.chunks_mut(CHUNK_VALUES).enumerate() {
            self.read(index, piece)?;
        }
        Ok(values)
    }

    /// Makes sure that all its pieces stand in the folder, from where a resumed run reads them.
    ///
    /// # Errors
    /// When the folder refuses.
    pub fn persist(&self) -> Result<(), StateError> {
        self.0.names.iter().try_for_each(|name| self.0.store.persist(name))
    }

    /// Has those of its pieces that stand in the folder stay there when nobody holds them any more.
    pub fn leave(&self) {
        let mut table = self.0.store.lock();
        self.0.names.iter().for_each(|name| table.leave(name));
    }
}
