//! How many workers there should be for the work there is. Pure: looks in, changes out; time is what a look brings.
//!
//! Workers are added when all looks of a short time ask for more than there are, and ended when none of a longer time has asked for
//! as many: between two batches of an ensemble there is nothing to do for a moment, and a node that was queued for is worth more than
//! that moment. Next file to read: `src/deploy/scale.rs`, which looks and acts.

use std::collections::VecDeque;
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// The least and the most workers of a deployment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limits {
    /// The least; may be zero.
    pub least: usize,
    /// The most, at least one.
    pub most: usize,
}

impl FromStr for Limits {
    type Err = String;

    /// Reads `MIN..MAX`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected MIN..MAX, such as 0..16: the least and the most workers".to_owned();
        let (least, most) = text.split_once("..").ok_or_else(wrong)?;
        let number = |text: &str| text.trim().parse::<usize>().map_err(|_| wrong());
        let (least, most) = (number(least)?, number(most)?);
        if most == 0 || least > most {
            return Err("the most workers must be at least 1, and no fewer than the least".to_owned());
        }
        Ok(Self { least, most })
    }
}

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.least, self.most)
    }
}

impl Limits {
    /// Workers for so many unfinished runs, with so many slots each.
    pub fn wanted(self, unfinished: usize, slots: usize) -> usize {
        unfinished.div_ceil(slots.max(1)).clamp(self.least, self.most)
    }
}

/// How long the work has to ask for a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// For more workers.
    pub add: Duration,
    /// For fewer; no shorter than that for more.
    pub release: Duration,
}

/// What is to be done after a look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Nothing.
    None,
    /// So many workers more.
    Add(usize),
    /// So many workers fewer.
    Release(usize),
}

/// What was wanted of late.
#[derive(Clone, Debug)]
pub struct Policy {
    limits: Limits,
    patience: Patience,
    /// Time of a look, and what was wanted. The first one is the last that is as old as the longer patience, where there is one.
    looks: VecDeque<(Duration, usize)>,
}

impl Policy {
    /// Without a look so far.
    pub fn new(limits: Limits, patience: Patience) -> Self {
        Self { limits, patience, looks: VecDeque::new() }
    }

    /// What follows from a look at a time, no earlier than the one before, at which so many workers were wanted and so many are there or
    /// on their way.
    pub fn look(&mut self, at: Duration, wanted: usize, there: usize) -> Change {
        self.looks.push_back((at, wanted.clamp(self.limits.least, self.limits.most)));
        while self.looks.get(1).is_some_and(|(then, _)| at.saturating_sub(*then) >= self.patience.release) {
            self.looks.pop_front();
        }
        let least = self.over(self.patience.add).and_then(Iterator::min);
        let most = self.over(self.patience.release).and_then(Iterator::max);
        match (least, most) {
            (Some(least), _) if least > there => Change::Add(least - there),
            (_, Some(most)) if most < there => Change::Release(there - most),
            _ => Change::None,
        }
    }

    /// What was wanted during so long until now; nothing where nobody has looked for so long.
    fn over(&self, time: Duration) -> Option<impl Iterator<Item = usize>> {
        let now = self.looks.back()?.0;
        // What was wanted at a look held until the next one.
        let begin = self.looks.iter().rposition(|(then, _)| now.saturating_sub(*then) >= time)?;
        Some(self.looks.range(begin..).map(|(_, wanted)| *wanted))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const PATIENCE: Patience = Patience { add: Duration::from_secs(5), release: Duration::from_secs(60) };

    fn policy(least: usize, most: usize) -> Policy {
        Policy::new(Limits { least, most }, PATIENCE)
    }

    fn seconds(s: u64) -> Duration {
        Duration::from_secs(s)
    }

    #[test]
    fn limits_are_read_and_nonsense_is_refused() {
        assert_eq!("0..16".parse(), Ok(Limits { least: 0, most: 16 }));
        assert_eq!("2..2".parse(), Ok(Limits { least: 2, most: 2 }));
        for wrong in ["", "4", "4..", "..4", "4..2", "0..0", "-1..2", "a..b", "1...4"] {
            assert!(wrong.parse::<Limits>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn work_is_spread_over_slots_within_the_limits() {
        let limits = Limits { least: 1, most: 8 };
        let wanted =
            [(0, 2), (1, 2), (5, 2), (99, 2), (3, 0)].map(|(runs, slots)| limits.wanted(runs, slots));
        assert_eq!(wanted, [1, 1, 3, 8, 3]);
    }

    #[test]
    fn a_queue_that_stays_adds_workers_and_a_pause_between_batches_ends_none() {
        let mut policy = policy(1, 8);
        assert_eq!(policy.look(seconds(0), 6, 1), Change::None, "one look is none");
        assert_eq!(policy.look(seconds(5), 4, 1), Change::Add(3), "the least of both looks");
        for t in 6..200 {
            // Nothing to do every other second.
            let wanted = if t % 2 == 0 { 4 } else { 1 };
            assert_eq!(policy.look(seconds(t), wanted, 4), Change::None, "{t}");
        }
    }

    #[test]
    fn the_tail_of_a_run_ends_what_it_does_not_need_after_the_longer_time() {
        let mut policy = policy(1, 8);
        for t in 0..10 {
            policy.look(seconds(t), 8, 8);
        }
        for t in 10..69 {
            assert_eq!(policy.look(seconds(t), 2, 8), Change::None, "{t}");
        }
        // At 9 s eight were wanted, which held until 10 s.
        assert_eq!(policy.look(seconds(69), 2, 8), Change::None);
        assert_eq!(policy.look(seconds(70), 2, 8), Change::Release(6));
    }

    #[test]
    fn a_watch_that_has_just_begun_ends_nothing() {
        let mut policy = policy(0, 4);
        let changes: Vec<_> = (0..=60).map(|t| policy.look(seconds(t), 0, 4)).collect();
        assert!(changes[..60].iter().all(|change| *change == Change::None), "{changes:?}");
        assert_eq!(changes[60], Change::Release(4));
    }

    proptest! {
        #[test]
        fn the_limits_hold_and_a_change_is_not_taken_back_within_the_patience(
            least in 0_usize..4,
            more in 1_usize..12,
            looks in proptest::collection::vec((1_u64..20, 0_usize..40, 0_usize..3), 1..200),
        ) {
            let most = least + more;
            let mut policy = policy(least, most);
            let (mut t, mut there) = (0, least);
            let (mut added, mut released) = (None, None);
            for (step, wanted, kept) in looks {
                t += step;
                match policy.look(seconds(t), wanted, there) {
                    Change::None => {}
                    Change::Add(n) => {
                        there += n;
                        prop_assert!(n > 0 && released.is_none_or(|at| t - at >= PATIENCE.add.as_secs()));
                        added = Some(t);
                    }
                    Change::Release(n) => {
                        // Those that compute are kept.
                        let n_ended = n.saturating_sub(kept);
                        there -= n_ended;
                        prop_assert!(n > 0 && added.is_none_or(|at| t - at >= PATIENCE.release.as_secs()));
                        released = Some(t);
                    }
                }
                prop_assert!((least..=most).contains(&there));
            }
        }
    }
}
