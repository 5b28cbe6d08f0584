//! How long a run may still take: time in which it could not go on is not counted.
//!
//! A program that somebody stopped (SIGSTOP, a debugger) makes no progress, and neither does anything while the whole machine
//! stands still, so neither says anything of the run. No clock is read here. Next file to read: [`super::stopped`].

use std::time::{Duration, Instant};

/// How far apart a caller looks at most.
const LOOK: Duration = Duration::from_secs(1);
/// Time between two looks that is counted at most: what is beyond it is a pause of this process itself.
const COUNTED: Duration = Duration::from_secs(2);

/// The time of one run.
pub(crate) struct Stopwatch {
    limit: Duration,
    last: Instant,
    worked: Duration,
    stood: Duration,
}

/// What a look says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Time {
    /// It may go on; look again after so long.
    Left(Duration),
    /// It used up its limit.
    Up,
    /// It was stopped for as long as it may run.
    Stopped,
}

impl Stopwatch {
    /// A run that begins now and may take so long.
    pub(crate) fn start(limit: Duration, now: Instant) -> Self {
        Self { limit, last: now, worked: Duration::ZERO, stood: Duration::ZERO }
    }

    /// Counts the time since the last look, as work or, where the program `is_stopped`, as standing still.
    pub(crate) fn look(&mut self, now: Instant, is_stopped: impl FnOnce() -> bool) -> Time {
        let since = now.saturating_duration_since(self.last);
        // Whether a program is stopped takes long to find out.
        if since >= self.left() {
            self.last = now;
            let of = if is_stopped() { &mut self.stood } else { &mut self.worked };
            *of = of.saturating_add(since.min(COUNTED));
        }
        if self.worked >= self.limit {
            Time::Up
        } else if self.stood >= self.limit {
            Time::Stopped
        } else {
            Time::Left(self.left().saturating_sub(now.saturating_duration_since(self.last)))
        }
    }

    /// From the last count to the next.
    fn left(&self) -> Duration {
        self.limit.saturating_sub(self.worked.max(self.stood)).min(LOOK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: Duration = Duration::from_millis(500);

    /// Looks every half second; after how many of them the run is over, and how.
    fn over(limit: u64, is_stopped: impl Fn(u32) -> bool) -> (u32, Time) {
        let start = Instant::now();
        let mut watch = Stopwatch::start(Duration::from_secs(limit), start);
        let mut looks = (1..).map(|n| (n, watch.look(start + STEP * n, || is_stopped(n))));
        looks.find(|(_, time)| !matches!(time, Time::Left(_))).expect("it ends")
    }

    #[test]
    fn a_run_is_over_at_its_limit() {
        assert_eq!(over(5, |_| false), (10, Time::Up));
        let now = Instant::now();
        let mut short = Stopwatch::start(Duration::from_millis(30), now);
        assert_eq!(short.look(now, || false), Time::Left(Duration::from_millis(30)));
        assert_eq!(short.look(now + Duration::from_millis(30), || false), Time::Up);
    }

    #[test]
    fn time_that_a_program_was_stopped_is_not_counted_and_does_not_last_for_ever() {
        // Stopped from 2 s to 5 s.
        assert_eq!(over(5, |n| (5..=10).contains(&n)), (16, Time::Up));
        assert_eq!(over(5, |_| true), (10, Time::Stopped));
    }

    #[test]
    fn a_pause_of_this_process_is_not_counted() {
        let start = Instant::now();
        let mut watch = Stopwatch::start(Duration::from_secs(10), start);
        let later = start + Duration::from_hours(1);
        assert_eq!(watch.look(later, || false), Time::Left(LOOK));
        assert_eq!(watch.look(later + 8 * LOOK, || false), Time::Left(LOOK));
    }

    #[test]
    fn a_run_without_a_limit_is_never_over() {
        let start = Instant::now();
        let mut watch = Stopwatch::start(Duration::MAX, start);
        assert_eq!(watch.look(start + Duration::from_hours(100), || false), Time::Left(LOOK));
    }
}
