//! Where workers come in, and who was turned away there.
//!
//! Next file to read: [`super::telling`].

use std::net::SocketAddr;

/// What somebody who waits for workers may want to know.
#[derive(Default)]
pub(super) struct Doorway {
    /// Where workers can connect.
    pub(super) address: Option<SocketAddr>,
    /// The last one that was turned away: from where, and why.
    pub(super) refused: Option<String>,
}
