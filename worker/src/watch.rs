//! Whether a worker works or is idle, told when it changes.
//!
//! Looked at with every heartbeat, so that the gap between two batches is no news. Next file to read: [`crate::session`].

use crate::news::{News, Tell};
use crate::slots::Slots;

pub(crate) struct Watch {
    /// What was told last.
    works: Option<bool>,
    answered: u64,
}

impl Watch {
    pub(crate) fn new(slots: &Slots) -> Self {
        Self { works: None, answered: answered(slots) }
    }

    pub(crate) fn look(&mut self, slots: &Slots, tell: &Tell) {
        let (running, queued) = slots.load();
        let now = answered(slots);
        let works = running + queued > 0 || now > self.answered;
        self.answered = now;
        // At first it is idle, which is no news.
        if self.works.replace(works).unwrap_or(false) != works {
            tell(&if works { News::Working } else { News::Idle { answered: now } });
        }
    }
}

fn answered(slots: &Slots) -> u64 {
    let (predictions, failures) = slots.answered();
    predictions + failures
}
