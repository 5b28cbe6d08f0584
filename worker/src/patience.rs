//! How long a worker goes on without a coordinator: for its patience, or as long as one that stays may be idle.
//!
//! What computes is no idleness, and what is held is kept for the patience at least. Next file to read: [`crate::dial`].

use std::time::{Duration, Instant};

use crate::held::Held;
use crate::idle::Idle;
use crate::slots::Slots;

/// What is left of the wait for a coordinator.
pub(crate) struct Patience<'a> {
    limit: Duration,
    since: Instant,
    idle: Option<&'a mut Idle>,
    slots: &'a Slots,
    /// What an earlier coordinator may lack, where it went without a word.
    owes: Option<&'a Held>,
    /// Somebody was told that there is no coordinator.
    pub(crate) is_told: bool,
}

impl<'a> Patience<'a> {
    /// One that begins now.
    pub(crate) fn new(
        limit: Duration,
        idle: Option<&'a mut Idle>,
        slots: &'a Slots,
        owes: Option<&'a Held>,
        is_told: bool,
    ) -> Self {
        Self { limit, since: Instant::now(), idle, slots, owes, is_told }
    }

    /// What is left.
    pub(crate) fn left(&mut self) -> Duration {
        let dropped = self.dropped();
        let Some(idle) = &mut self.idle else { return self.limit.saturating_sub(self.since.elapsed()) };
        idle.look(self.slots, false);
        let for_results = if dropped > 0 { self.limit } else { Duration::ZERO };
        idle.left_of(for_results)
    }

    /// Results that are lost when it ends.
    pub(crate) fn dropped(&self) -> usize {
        let (computing, waiting) = self.slots.load();
        let computed = self.owes.map_or(0, Held::len);
        if self.owes.is_some() { computed + (computing + waiting) as usize } else { 0 }
    }

    /// The option that sets the wait.
    pub(crate) fn option(&self) -> &'static str {
        if self.idle.is_some() { "--idle" } else { "--patience" }
    }
}
