//! The time that a run has computed, as every place that makes runs measures it.

use std::cell::Cell;
use std::time::{Duration, Instant};

use rustix::time::{ClockId, Timespec, clock_gettime};

/// How old a reading of a thread's clock may be where a run begins: the clock is a call of the system, which short runs in a row feel.
const FRESH: Duration = Duration::from_micros(200);

thread_local! {
    /// When the clock of this thread was read last, and what it said.
    static READ: Cell<Option<(Instant, f64)>> = const { Cell::new(None) };
}

/// Seconds of processor time of this thread since this call, or up to .2 ms more. A thread that waits for a processor, or stands still
/// with its whole machine, spends none, so that a busy place decides as a quiet one does.
pub fn spent() -> impl Fn() -> f64 {
    let fresh = READ.get().filter(|(at, _)| at.elapsed() < FRESH);
    let start = fresh.map_or_else(read, |(_, seconds)| seconds);
    move || read() - start
}

/// Seconds of processor time that this thread has spent.
fn read() -> f64 {
    let Timespec { tv_sec, tv_nsec } = clock_gettime(ClockId::ThreadCPUTime);
    let seconds = tv_sec as f64 + 1e-9 * tv_nsec as f64;
    READ.set(Some((Instant::now(), seconds)));
    seconds
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compute(seconds: f64) {
        let start = read();
        while read() - start < seconds {}
    }

    #[test]
    fn a_thread_that_sleeps_spends_nothing_and_one_that_computes_does() {
        let run = spent();
        std::thread::sleep(Duration::from_millis(50));
        assert!(run() < 0.02, "{}", run());
        compute(0.05);
        assert!((0.05..0.1).contains(&run()), "{}", run());
    }

    #[test]
    fn a_run_behind_a_long_one_begins_at_nothing() {
        let long = spent();
        // Nothing reads the clock meanwhile.
        let start = Instant::now();
        while start.elapsed() < Duration::from_millis(20) {}
        let next = spent();
        assert!(next() < 1e-3, "{}", next());
        assert!(long() > next());
        // One that begins right behind it shares its reading, and is no more than that ahead.
        let shared = spent();
        assert!((0.0..1e-3).contains(&shared()), "{}", shared());
    }
}
