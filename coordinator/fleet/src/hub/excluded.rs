//! Processes that were put out and are not taken again.

use std::collections::VecDeque;

/// Processes remembered; the first ones are forgotten beyond.
const KEPT: usize = 1024;

/// By the number that each process drew for itself, with why; in the order in which they were put out.
#[derive(Default)]
pub(super) struct Excluded {
    reasons: VecDeque<(u64, String)>,
}

impl Excluded {
    pub(super) fn add(&mut self, nonce: u64, reason: &str) {
        self.reasons.retain(|(known, _)| *known != nonce);
        if self.reasons.len() >= KEPT {
            self.reasons.pop_front();
        }
        self.reasons.push_back((nonce, format!("it was put out: {reason}")));
    }

    /// Why the process that drew this number is not taken.
    pub(super) fn why(&self, nonce: u64) -> Option<&str> {
        self.reasons.iter().find(|(known, _)| *known == nonce).map(|(_, reason)| reason.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_one_is_forgotten_when_there_are_too_many_whatever_number_it_drew() {
        let mut excluded = Excluded::default();
        // The last ones drew the smallest numbers.
        let numbers: Vec<u64> = (0..=KEPT as u64).rev().collect();
        for number in &numbers {
            excluded.add(*number, "it lies");
        }
        assert_eq!(excluded.why(numbers[0]), None);
        assert!(numbers[1..].iter().all(|number| excluded.why(*number) == Some("it was put out: it lies")));
        excluded.add(numbers[1], "it lies again");
        assert_eq!(excluded.reasons.len(), KEPT);
        assert!(excluded.why(numbers[2]).is_some());
    }
}
