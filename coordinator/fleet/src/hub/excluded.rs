//! Processes that were put out and are not taken again.

use std::collections::BTreeMap;

/// Processes remembered; the first ones are forgotten beyond.
const KEPT: usize = 1024;

/// By the number that each process drew for itself, with why.
#[derive(Default)]
pub(super) struct Excluded {
    reasons: BTreeMap<u64, String>,
}

impl Excluded {
    pub(super) fn add(&mut self, nonce: u64, reason: &str) {
        if self.reasons.len() >= KEPT {
            self.reasons.pop_first();
        }
        self.reasons.insert(nonce, format!("it was put out: {reason}"));
    }

    /// Why the process that drew this number is not taken.
    pub(super) fn why(&self, nonce: u64) -> Option<&str> {
        self.reasons.get(&nonce).map(String::as_str)
    }
}
