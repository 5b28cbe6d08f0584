//! An address that is taken, before anybody is served there.
//!
//! Workers that dial meanwhile wait. Next file to read: [`super::grpc`].

use std::net::{SocketAddr, TcpListener};

use super::FleetError;

/// An address that workers can dial.
#[derive(Debug)]
pub struct Bound {
    pub(super) listener: TcpListener,
    pub(super) address: SocketAddr,
}

impl Bound {
    /// Takes the address; port 0 picks a free one.
    ///
    /// # Errors
    /// [`FleetError::Bind`] when it is taken or does not exist.
    pub fn new(address: SocketAddr) -> Result<Self, FleetError> {
        let bind = |source| FleetError::Bind { address, source };
        let listener = TcpListener::bind(address).map_err(bind)?;
        listener.set_nonblocking(true).map_err(bind)?;
        let address = listener.local_addr().map_err(bind)?;
        Ok(Self { listener, address })
    }
}
