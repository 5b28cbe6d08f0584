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
    /// The speed is the mean over the later half of the time so far, so that workers that come or go show, and one slow run does not. Between
    /// two looks at which something more is done the time left falls with the time that passes, until that takes longer than it should.
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
        let (last_s, last) = *self.looks.back()?;
        let middle = f64::midpoint(first, now_s);
        let later = self.looks.iter().position(|(at, _)| *at > middle).unwrap_or(self.looks.len());
        // Two looks at least, between which something was done.
        let from = later.saturating_sub(1).min(self.looks.len().checked_sub(2)?);
        let (from_s, before) = self.looks[from];
        let (passed, made) = (last_s - from_s, last - before);
        let rest = (total - last).max(0.0);
        let foreseen = rest * passed / made - (now_s - last_s);
        // As if as much were done just now as between two looks before.
        let steps = self.looks.iter().skip(from).zip(self.looks.iter().skip(from + 1));
        let step = steps.map(|((_, a), (_, b))| b - a).fold(0.0, f64::max).min(rest);
        let at_least = (rest - step) * (now_s - from_s) / (made + step);
        (passed > 0.0 && made > 0.0).then(|| foreseen.max(at_least))
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
    fn between_two_looks_the_time_left_falls_with_time_and_no_further_than_work_that_is_late() {
        let mut pace = Pace::default();
        for k in 0..=10 {
            pace.left(f64::from(k), f64::from(k), 30.0);
        }
        let left = |pace: &mut Pace, now| pace.left(now, 10.0, 30.0).expect("it is known");
        assert!((left(&mut pace, 10.0) - 20.0).abs() < 1e-9);
        assert!((left(&mut pace, 10.5) - 19.5).abs() < 1e-9);
        // The eleventh unit is four seconds late: nineteen would be left after four units in the last eight seconds.
        let late = left(&mut pace, 15.0);
        assert!((late - 38.0).abs() < 1e-9, "{late}");
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
