//! How fast a program that does not start may be started again.

use std::time::Duration;

/// Wait after the first failure; doubled for each further one, up to [`LONGEST`].
const FIRST: Duration = Duration::from_millis(100);
const LONGEST: Duration = Duration::from_secs(5);

/// Failures in a row.
#[derive(Debug, Default)]
pub(crate) struct Backoff {
    failures: u32,
}

impl Backoff {
    /// How long to wait before the next start.
    pub(crate) fn pause(&self) -> Duration {
        match self.failures {
            0 => Duration::ZERO,
            n => FIRST.saturating_mul(1 << (n - 1).min(10)).min(LONGEST),
        }
    }

    /// A start worked.
    pub(crate) fn worked(&mut self) {
        self.failures = 0;
    }

    /// A start failed.
    pub(crate) fn failed(&mut self) {
        self.failures += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wait_doubles_up_to_its_limit_and_starts_over_after_a_success() {
        let mut backoff = Backoff::default();
        assert_eq!(backoff.pause(), Duration::ZERO);
        backoff.failed();
        backoff.failed();
        assert_eq!(backoff.pause(), 2 * FIRST);
        (0..40).for_each(|_| backoff.failed());
        assert_eq!(backoff.pause(), LONGEST);
        backoff.worked();
        assert_eq!(backoff.pause(), Duration::ZERO);
    }
}
