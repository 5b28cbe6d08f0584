//! What the values of options of the fleet mean.

use std::net::{SocketAddr, ToSocketAddrs};

use starlings_coordinator::study::bytes_of;

use crate::failure::Failure;

/// Where to listen, as it was asked for.
pub(crate) fn address(text: &str) -> Result<SocketAddr, Failure> {
    text.to_socket_addrs()
        .ok()
        .and_then(|mut all| all.next())
        .ok_or_else(|| Failure::input(format!("--listen {text}: expected HOST:PORT, such as 127.0.0.1:7000")))
}

/// Bytes of an amount such as `8 GiB`.
pub(crate) fn memory(text: &str) -> Result<usize, String> {
    let bytes = bytes_of(text).filter(|bytes| (0.0..1e18).contains(bytes));
    bytes
        .map(|bytes| bytes as usize)
        .ok_or_else(|| "expected a number with its unit, such as \"8 GiB\"".to_owned())
}
