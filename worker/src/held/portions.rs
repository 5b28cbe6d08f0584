//! Results in messages of a bounded size.

use starlings_proto::{Bytes, HeldRun};

/// Runs in portions for messages.
pub(super) struct Portions {
    most: usize,
    all: Vec<Vec<HeldRun>>,
    last: usize,
}

impl Portions {
    /// None yet, of about so many bytes each.
    pub(super) fn of(most: usize) -> Self {
        Self { most, all: Vec::new(), last: 0 }
    }

    pub(super) fn all(self) -> Vec<Vec<HeldRun>> {
        self.all
    }

    pub(super) fn add(&mut self, run: HeldRun) {
        let bytes = run.key.len() + run.ended.as_ref().map_or(0, Bytes::len);
        if self.all.is_empty() || self.last + bytes > self.most {
            self.all.push(Vec::new());
            self.last = 0;
        }
        self.last += bytes;
        if let Some(portion) = self.all.last_mut() {
            portion.push(run);
        }
    }
}
