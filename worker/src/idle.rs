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

    /// Looks whether there was work since the last look, in the slots or elsewhere.
    pub(crate) fn look(&mut self, slots: &Slots, elsewhere: bool) {
        let answered = slots.answered();
        if elsewhere || slots.load() != (0, 0) || answered != self.answered {
            self.since = Instant::now();
            self.answered = answered;
        }
    }

    /// A coordinator is there, which may have work.
    pub(crate) fn begin(&mut self) {
        self.since = Instant::now();
    }

    /// The time that is left.
    pub(crate) fn left(&self) -> Duration {
        self.left_of(Duration::ZERO)
    }

    /// The same where the limit is at least this.
    pub(crate) fn left_of(&self, least: Duration) -> Duration {
        self.limit.max(least).saturating_sub(self.since.elapsed())
    }

    /// Why the worker ends.
    pub(crate) fn reason(&self) -> String {
        format!("it had no work for {} s (`--idle` sets the limit)", self.limit.as_secs_f64())
    }
}
