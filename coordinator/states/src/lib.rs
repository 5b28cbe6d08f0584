//! States of particles that are too large to travel inside a message: kept in pieces by name, in memory up to a limit and in a
//! folder beyond it. Where workers are processes of this machine, whole states are in memory that these see too.
//!
//! A [`StateStore`] holds every piece for as long as a [`StoredState`] needs it; equal pieces are held once. Nothing here knows
//! jobs, workers or studies, and nothing computes. Next file to read: [`store`].

mod error;
mod held;
mod lent;
mod memory;
mod shared;
pub mod store;
mod stored;
mod table;
#[cfg(test)]
mod tests;
mod writer;

pub use error::StateError;
pub use held::Held;
pub use lent::{Lent, not_finite};
pub use starlings_pieces::{Folder, PieceError, PlaceName, hex};
pub use starlings_proto::StateId;
pub use starlings_proto::convert::state::{CHUNK_VALUES, ChunkId, n_chunks};
pub use store::StateStore;
pub use stored::StoredState;
pub use writer::StateWriter;
