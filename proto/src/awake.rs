//! Waiting awake: what comes within some microseconds comes too early for a thread that sleeps, which has to be woken first.
//!
//! A processor that has nothing to do is halted, and to wake it takes longer than a short run does. Next file to read:
//! [`crate::socket`].

use std::time::{Duration, Instant};

/// How long a thread waits awake before it sleeps.
const AWAKE: Duration = Duration::from_micros(100);

/// Waits awake until something is there, a tenth of a millisecond at most, and says whether it is; others that could compute meanwhile
/// do.
pub fn awaits(mut is_there: impl FnMut() -> bool) -> bool {
    let end = Instant::now() + AWAKE;
    loop {
        if is_there() {
            return true;
        }
        if Instant::now() > end {
            return false;
        }
        std::thread::yield_now();
    }
}
