//! How long runs of one setup take: what is usual, to tell what is not.

use std::collections::VecDeque;

/// Run times kept.
const KEPT: usize = 101;

/// The latest run times of a setup.
#[derive(Debug, Default)]
pub(super) struct RunTimes {
    latest: VecDeque<f64>,
}

impl RunTimes {
    pub(super) fn learn(&mut self, seconds: f64) {
        if self.latest.len() == KEPT {
            self.latest.pop_front();
        }
        self.latest.push_back(seconds);
    }

    /// The last one, seconds; zero before the first run.
    pub(super) fn last(&self) -> f64 {
        self.latest.back().copied().unwrap_or(0.0)
    }

    /// Runs known, up to those kept.
    pub(super) fn len(&self) -> usize {
        self.latest.len()
    }

    /// Median, seconds; `None` before the first run.
    pub(super) fn median(&self) -> Option<f64> {
        let mut sorted = self.latest.iter().copied().collect::<Vec<_>>();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied()
    }
}
