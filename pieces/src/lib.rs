//! Where large states stand: pieces in files by the hash of their bytes, in a folder of one process or in one that machines share; with
//! the feature `s3` as objects of a bucket; or whole in memory that processes of one machine share.
//!
//! Coordinator and workers see this crate; nothing here knows states, jobs or messages. Next file to read: [`folder`], then
//! [`place`] for what machines share and [`memory`] for what processes do.

mod access;
#[cfg(feature = "s3")]
mod bucket;
pub mod error;
mod files;
pub mod folder;
pub mod mapped;
pub mod memory;
pub mod place;
pub mod sealed;

pub use error::PieceError;
pub use folder::{Folder, Staged};
pub use mapped::Mapped;
pub use memory::SharedMemory;
pub use place::PlaceName;
pub use sealed::Sealed;

/// Name of a piece: BLAKE3 of its bytes.
pub type PieceName = [u8; 32];

/// A name in hexadecimal.
pub fn hex<const N: usize>(name: &[u8; N]) -> String {
    use std::fmt::Write as _;
    name.iter().fold(String::with_capacity(2 * N), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
