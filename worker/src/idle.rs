//! How long a worker that stays has had no work.

use std::time::{Duration, Instant};

use crate::slots::Slots;

/// The time since the last job, for a worker that stays between commands.
pub(crate) struct Idle {
    limit: Duration,
    since: Instant,
    answered: (u64, u64),
}

impl Idle {
    pub(crate) fn new(limit: Duration) -> Self {
        Self { limit, since: Instant::now(), answered: (0, 0) }
    }

    /// Looks whether there was work since the last look.
    pub(crate) fn look(&mut self, slots: &Slots) {
        let answered = slots.answered();
        if slots.load() != (0, 0) || answered != self.answered {
            self.since = Instant::now();
            self.answered = answered;
        }
    }

    /// The time that is left.
    pub(crate) fn left(&self) -> Duration {
        self.limit.saturating_sub(self.since.elapsed())
    }

    /// Why the worker ends.
    pub(crate) fn reason(&self) -> String {
        format!("it had no work for {} s (`--idle` sets the limit)", self.limit.as_secs_f64())
    }
}
