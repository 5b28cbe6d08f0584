//! How long the rest takes, from how fast the work was lately.
//!
//! Next file to read: [`super::view`].

use std::collections::VecDeque;

/// Looks that are kept.
const KEPT: usize = 256;

/// Work against time.
#[derive(Clone, Debug, Default)]
pub struct Pace {
    looks: VecDeque<(f64, f64)>,
}

impl Pace {
    /// Time left, s, where so much of `total` is done at this time; `None` until there is something to tell it from.
    ///
    /// The speed is the mean over the later half of the time so far, so that workers that come or go show, and one slow run does not.
    pub fn left(&mut self, now_s: f64, done: f64, total: f64) -> Option<f64> {
        if self.looks.back().is_none_or(|(_, before)| done > *before) {
            self.looks.push_back((now_s, done));
        }
        if self.looks.len() > KEPT {
            // Every other one, and the first.
            let mut at = 0;
            self.looks.retain(|_| {
                at += 1;
                at % 2 == 1
            });
        }
        let (first, _) = *self.looks.front()?;
        let middle = f64::midpoint(first, now_s);
        let later = self.looks.iter().position(|(at, _)| *at > middle).unwrap_or(self.looks.len());
        let (from_s, from) = *self.looks.get(later.saturating_sub(1))?;
        let (passed, made) = (now_s - from_s, done - from);
        (passed > 0.0 && made > 0.0).then(|| (total - done).max(0.0) * passed / made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_at_a_steady_speed_has_the_rest_of_its_time_left() {
        let mut pace = Pace::default();
        assert_eq!(pace.left(3.0, 0.0, 100.0), None);
        for k in 1..=10_000 {
            let done = f64::from(k) / 100.0;
            let left = pace.left(3.0 + 0.5 * done, done, 100.0).expect("it is known");
            // Exact but for roundings.
            assert!((left - 0.5 * (100.0 - done)).abs() < 1e-6, "{left} at {done}");
        }
        assert!(pace.looks.len() <= KEPT);
    }

    #[test]
    fn workers_that_leave_show_before_as_much_time_has_passed_again() {
        let mut pace = Pace::default();
        for k in 0..=10 {
            pace.left(f64::from(k), f64::from(k), 30.0);
        }
        let mut left = None;
        for k in 1..=10 {
            left = pace.left(10.0 + f64::from(k), 10.0 + 0.5 * f64::from(k), 30.0);
        }
        // 15 of 30 at half a unit a second.
        assert!((left.expect("known") - 30.0).abs() < 1.0, "{left:?}");
    }
}
