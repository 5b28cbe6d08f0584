//! What solvers share on one machine: its cores and its ports.

use std::io;
use std::net::TcpListener;

/// The cores of the program of this number: as many as it has threads, in turn.
pub(crate) fn cores(number: usize, threads: usize) -> Vec<usize> {
    let all = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    (0..threads.clamp(1, all)).map(|i| (number * threads + i) % all).collect()
}

/// A loopback port that nobody listens on at this moment.
pub(crate) fn free_port() -> io::Result<u16> {
    Ok(TcpListener::bind(("127.0.0.1", 0))?.local_addr()?.port())
}
