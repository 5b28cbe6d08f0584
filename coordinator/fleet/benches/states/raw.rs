//! The limit of the same run: the same bytes over pairs of sockets and back, with nothing done to them.

use std::io::{Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{BLOCK, Failure, PARTICLES, VALUES, WORKERS};

/// What tells this program to be the other end.
pub(super) const ECHO: &str = "--echo";

/// Ends the echo process with the measurement.
struct Echo(Child);

impl Drop for Echo {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Wall times of the same bytes there and back over pairs of sockets, fastest first.
pub(super) fn walls(cycles: usize) -> Result<Vec<Duration>, Failure> {
    let mut ends = Vec::new();
    for _ in 0..WORKERS {
        let (own, its) = UnixStream::pair()?;
        let mut command = Command::new(std::env::current_exe()?);
        command.arg(ECHO).stdin(Stdio::from(OwnedFd::from(its)));
        ends.push((own, Echo(command.spawn()?)));
    }
    let blocks = 8 * VALUES * PARTICLES / WORKERS / BLOCK;
    let mut walls = Vec::new();
    for _ in 0..=cycles {
        let started = Instant::now();
        std::thread::scope(|scope| {
            for (end, _) in &ends {
                let (mut write, mut read) = (end, end);
                scope.spawn(move || {
                    let bytes = vec![1; BLOCK];
                    (0..blocks).try_for_each(|_| write.write_all(&bytes))
                });
                scope.spawn(move || {
                    let mut bytes = vec![0; BLOCK];
                    (0..blocks).try_for_each(|_| read.read_exact(&mut bytes))
                });
            }
        });
        walls.push(started.elapsed());
    }
    walls.sort_unstable();
    Ok(walls)
}

pub(super) fn echo() -> Result<(), Failure> {
    let mut end = UnixStream::from(std::io::stdin().as_fd().try_clone_to_owned()?);
    let mut bytes = vec![0; BLOCK];
    while end.read_exact(&mut bytes).is_ok() {
        end.write_all(&bytes)?;
    }
    Ok(())
}
