//! Why a state cannot be kept or read.

use std::path::PathBuf;
use std::sync::Arc;

/// What is wrong with a state or with the folder that holds its pieces.
#[derive(Clone, Debug, thiserror::Error)]
pub enum StateError {
    /// The folder refuses.
    #[error("cannot {what} {} for the states of particles: {source}", path.display())]
    Folder {
        /// What was tried.
        what: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: Arc<std::io::Error>,
    },
    /// A piece that is not there.
    #[error("the piece {piece} of a particle's state is missing: expected the file {}", path.display())]
    Missing {
        /// Name of the piece, hexadecimal.
        piece: String,
        /// Where it was expected.
        path: PathBuf,
    },
    /// A piece that is not what its name says.
    #[error("the piece {piece} of a particle's state is damaged: the file {} holds something else", path.display())]
    Damaged {
        /// Name of the piece, hexadecimal.
        piece: String,
        /// Where it stands.
        path: PathBuf,
    },
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
}
