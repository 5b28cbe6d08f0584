//! Why a state cannot be kept or read.

use std::sync::Arc;

use starlings_pieces::PieceError;

/// What is wrong with a state or with the folder that holds its pieces.
#[derive(Clone, Debug, thiserror::Error)]
pub enum StateError {
    /// A piece.
    #[error(transparent)]
    Piece(#[from] PieceError),
    /// Pieces that do not make a state of the length that was said.
    #[error("a state of {n_state} values with a piece of {bytes} bytes as number {index}")]
    Pieces {
        /// Values of the state.
        n_state: usize,
        /// Which piece, from 0.
        index: usize,
        /// Its length; 0 where it is missing.
        bytes: usize,
    },
    /// A state with a value that is none.
    #[error("{value} is a value of the state")]
    NotFinite {
        /// The value.
        value: f64,
    },
    /// Memory of a whole state.
    #[error("cannot {what} the memory of a particle's state: {source}")]
    Memory {
        /// What was tried.
        what: &'static str,
        /// What the system said.
        source: Arc<std::io::Error>,
    },
}

impl StateError {
    /// Whether a piece is not where it belongs.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Piece(PieceError::Missing { .. }))
    }
}
