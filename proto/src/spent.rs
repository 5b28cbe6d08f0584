//! The time that a run has computed, as every place that makes runs measures it.

use rustix::time::{ClockId, Timespec, clock_gettime};

/// Seconds of processor time of this thread since this call. A thread that waits for a processor, or stands still with its whole
/// machine, spends none, so that a busy place decides as a quiet one does.
pub fn spent() -> impl Fn() -> f64 {
    let now = || clock_gettime(ClockId::ThreadCPUTime);
    let seconds = |t: Timespec| t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64;
    let start = seconds(now());
    move || seconds(now()) - start
}
