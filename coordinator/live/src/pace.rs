//! How long the rest takes, from how long what was done of every kind of work took, and how fast it was lately.
//!
//! A unit of one kind of work takes as long as units of it took so far; of a kind of which nothing is done yet as long as it should beside
//! the others ([`Takes`]). That is what the rest takes at the mean speed so far; it is multiplied by how much slower work was in the later
//! half of the time than over all of it, so that workers that come or go show, and one slow run does not: the fewer looks tell a change the
//! less of it is believed. Next file to read: [`super::view`].

use std::collections::VecDeque;

use starlings_study::{Part, Takes, Work};

/// Looks that are kept.
const KEPT: usize = 256;
/// Looks after which half of a change of speed is believed: what single runs take differs by about as much as speeds do.
const BELIEVED: f64 = 1.0;

/// Work against time.
#[derive(Clone, Debug, Default)]
pub struct Pace {
    looks: VecDeque<Look>,
}

/// How much was done by a time, and how long it took since the first look, by kinds of work.
#[derive(Clone, Debug)]
struct Look {
    at_s: f64,
    done: Vec<f64>,
    spent_s: Vec<f64>,
}

/// How far a command is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reach {
    /// Share of its work that is done, in the time that it takes; `None` where there is none.
    pub share: Option<f64>,
    /// Time left, s; `None` where nothing tells it.
    pub left_s: Option<f64>,
}

/// Seconds that a unit of every kind takes; `None` where nothing tells it.
type Rates = Vec<Option<f64>>;

impl Pace {
    /// How far a command is at this time, whose work stands so.
    ///
    /// Between two looks at which something more is done the time left falls with the time that passes, until that takes longer than it
    /// should.
    pub fn at(&mut self, now_s: f64, work: &Work) -> Reach {
        self.look(now_s, work);
        let rates = self.rates(work);
        Reach { share: share(work, &rates), left_s: self.left(now_s, work, &rates).filter(|_| work.ends) }
    }

    /// Keeps how much is done, where that is more than before. The time since then is that of the kinds of which more is done.
    fn look(&mut self, now_s: f64, work: &Work) {
        let done: Vec<f64> = work.parts.iter().map(|part| part.done).collect();
        let rates = self.rates(work);
        let Some(last) = self.looks.back().filter(|last| last.done.len() == done.len()) else {
            let spent_s = vec![0.0; done.len()];
            self.looks = VecDeque::from([Look { at_s: now_s, done, spent_s }]);
            return;
        };
        let gains: Vec<f64> =
            done.iter().zip(&last.done).map(|(now, before)| (now - before).max(0.0)).collect();
        let expected: Vec<f64> =
            gains.iter().enumerate().map(|(k, gain)| gain * weight(work.parts[k].takes, rates[k])).collect();
        let all: f64 = expected.iter().sum();
        if all <= 0.0 {
            return;
        }
        let passed = now_s - last.at_s;
        let spent_s =
            last.spent_s.iter().zip(&expected).map(|(spent, of)| spent + passed * of / all).collect();
        let done = last.done.iter().zip(&gains).map(|(before, gain)| before + gain).collect();
        self.looks.push_back(Look { at_s: now_s, done, spent_s });
        if self.looks.len() > KEPT {
            // Every other one, and the first.
            let mut at = 0;
            self.looks.retain(|_| {
                at += 1;
                at % 2 == 1
            });
        }
    }

    /// What a unit of every kind takes.
    fn rates(&self, work: &Work) -> Rates {
        let known = self.looks.front().zip(self.looks.back());
        let known = known.filter(|(first, _)| first.done.len() == work.parts.len());
        let of = |k: usize| {
            known.map_or((0.0, 0.0), |(first, last)| (last.spent_s[k], last.done[k] - first.done[k]))
        };
        let (mut spent, mut weighed) = (0.0, 0.0);
        for (k, part) in work.parts.iter().enumerate() {
            if let Takes::Runs(weight) = part.takes {
                let (seconds, units) = of(k);
                (spent, weighed) = (spent + seconds, weighed + weight * units);
            }
        }
        let usual = (weighed > 0.0 && spent > 0.0).then(|| spent / weighed);
        let rate = |(k, takes): (usize, Takes)| match (of(k), takes) {
            ((seconds, units), _) if units > 0.0 && seconds > 0.0 => Some(seconds / units),
            (_, Takes::Runs(weight)) => usual.map(|usual| weight * usual),
            (_, Takes::Seconds(seconds)) => Some(seconds),
        };
        work.parts.iter().map(|part| part.takes).enumerate().map(rate).collect()
    }

    fn left(&self, now_s: f64, work: &Work, rates: &Rates) -> Option<f64> {
        let (first, last) = self.looks.front().zip(self.looks.back())?;
        let middle = f64::midpoint(first.at_s, now_s);
        let later = self.looks.iter().position(|look| look.at_s > middle).unwrap_or(self.looks.len());
        // Two looks at least, between which something was done, and one before: the first run alone has the start of everything in it.
        let from = later.saturating_sub(1).min(self.looks.len().checked_sub(3)?);
        let before = &self.looks[from];
        let took = |from: &Look, to: &Look| of_all(rates, &gains(from, to));
        let made = took(before, last)?;
        let passed = last.at_s - before.at_s;
        let left: Vec<f64> = work.parts.iter().map(|part| part.left).collect();
        let rest = of_all(rates, &left)?;
        let looks = (self.looks.len() - 1 - from) as f64;
        let slower = 1.0 + (passed / made - 1.0) * looks / (looks + BELIEVED);
        let foreseen = rest * slower - (now_s - last.at_s);
        // As if as much were done just now as between two looks before.
        let steps = self.looks.iter().skip(from).zip(self.looks.iter().skip(from + 1));
        let step = steps.filter_map(|(a, b)| took(a, b)).fold(0.0, f64::max).min(rest);
        let at_least = (rest - step) * (now_s - before.at_s) / (made + step);
        (passed > 0.0 && made > 0.0).then(|| foreseen.max(at_least))
    }
}

fn gains(from: &Look, to: &Look) -> Vec<f64> {
    to.done.iter().zip(&from.done).map(|(to, from)| to - from).collect()
}

/// Seconds of so many units of every kind.
fn of_all(rates: &Rates, units: &[f64]) -> Option<f64> {
    let known = |(rate, units): (&Option<f64>, &f64)| {
        if *units > 0.0 { rate.map(|rate| rate * units) } else { Some(0.0) }
    };
    rates.iter().zip(units).map(known).sum()
}

/// What a unit weighs beside others: the seconds that it takes, or before they are known what it should take of those of a run.
fn weight(takes: Takes, rate: Option<f64>) -> f64 {
    match (rate, takes) {
        (Some(rate), _) => rate,
        (None, Takes::Runs(weight)) => weight,
        (None, Takes::Seconds(_)) => 0.0,
    }
}

/// The share that is done; before anything tells how long runs take that of the runs alone.
fn share(work: &Work, rates: &Rates) -> Option<f64> {
    let known = rates.iter().all(Option::is_some);
    let weigh = |(part, rate): (&Part, &Option<f64>)| weight(part.takes, rate.filter(|_| known));
    let weights: Vec<f64> = work.parts.iter().zip(rates).map(weigh).collect();
    let of = |units: fn(&Part) -> f64| {
        work.parts.iter().zip(&weights).map(|(part, weight)| weight * units(part)).sum::<f64>()
    };
    let (done, left) = (of(|part| part.done), of(|part| part.left));
    (done + left > 0.0).then(|| (done / (done + left)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Work of one kind, of which so much is done, ten in all and twenty more.
    fn of(done: f64) -> Work {
        Work::of_runs(done, 0.0, 30.0)
    }

    fn left(pace: &mut Pace, now_s: f64, work: &Work) -> f64 {
        pace.at(now_s, work).left_s.expect("it is known")
    }

    /// Ten units at one a second.
    fn ten() -> Pace {
        let mut pace = Pace::default();
        for k in 0..=10 {
            pace.at(f64::from(k), &of(f64::from(k)));
        }
        pace
    }

    #[test]
    fn work_at_a_steady_speed_has_the_rest_of_its_time_left() {
        let mut pace = Pace::default();
        let all = |done| Work::of_runs(done, 0.0, 100.0);
        assert_eq!(pace.at(3.0, &all(0.0)), Reach { share: Some(0.0), left_s: None });
        for k in 1..=10_000 {
            let done = f64::from(k) / 100.0;
            let told = pace.at(3.0 + 0.5 * done, &all(done));
            // Exact but for roundings; the first unit alone tells nothing.
            assert_eq!(told.left_s.is_none(), k == 1, "{told:?}");
            let off = told.left_s.map_or(0.0, |left_s| left_s - 0.5 * (100.0 - done));
            assert!(off.abs() < 1e-6, "{told:?} at {done}");
            assert!((told.share.expect("known") - 0.01 * done).abs() < 1e-9, "{told:?} at {done}");
        }
        assert!(pace.looks.len() <= KEPT);
    }

    #[test]
    fn kinds_that_are_done_at_once_share_the_time_as_they_should() {
        let mut pace = Pace::default();
        let of = |done: f64, left: [f64; 2]| {
            let part = |weight, left| Part { takes: Takes::Runs(weight), done, left };
            Work { parts: vec![part(1.0, left[0]), part(0.4, left[1])], at: 0, next: 0.0, ends: true }
        };
        pace.at(0.0, &of(0.0, [10.0, 20.0]));
        pace.at(5.0, &of(5.0, [5.0, 15.0]));
        // Ten of both in ten seconds: 10/14 s and 4/14 s each.
        assert!((left(&mut pace, 10.0, &of(10.0, [0.0, 10.0])) - 40.0 / 14.0).abs() < 1e-9);
    }

    #[test]
    fn between_two_looks_the_time_left_falls_with_time_and_no_further_than_work_that_is_late() {
        let mut pace = ten();
        assert!((left(&mut pace, 10.0, &of(10.0)) - 20.0).abs() < 1e-9);
        assert!((left(&mut pace, 10.5, &of(10.0)) - 19.5).abs() < 1e-9);
        // The eleventh unit is four seconds late: nineteen would be left after four units in the last eight seconds.
        let late = left(&mut pace, 15.0, &of(10.0));
        assert!((late - 38.0).abs() < 1e-9, "{late}");
    }

    #[test]
    fn of_a_change_of_speed_that_two_looks_tell_two_thirds_are_believed() {
        let mut pace = Pace::default();
        for k in 0..3 {
            pace.at(f64::from(k), &of(f64::from(k)));
        }
        // Three units in five seconds, the last two in four: 6/5 of the mean, of which the rest of 27 takes 45 s.
        let told = left(&mut pace, 5.0, &of(3.0));
        assert!((told - 45.0 * (1.0 + 0.2 * 2.0 / 3.0)).abs() < 1e-9, "{told}");
    }

    #[test]
    fn workers_that_leave_show_before_as_much_time_has_passed_again() {
        let mut pace = ten();
        let told =
            (1..=10).map(|k| left(&mut pace, f64::from(10 + k), &of(10.0 + 0.5 * f64::from(k)))).last();
        // 15 of 30 at half a unit a second.
        assert!((told.expect("known") - 30.0).abs() < 1.0, "{told:?}");
    }

    /// Windows, whole records that should take a half as long, and two seconds of the coordinator's own.
    fn three(windows: [f64; 2], records: [f64; 2]) -> Work {
        let part = |takes, [done, left]: [f64; 2]| Part { takes, done, left };
        let parts = vec![
            part(Takes::Runs(1.0), windows),
            part(Takes::Runs(0.5), records),
            part(Takes::Seconds(2.0), [0.0, 1.0]),
        ];
        Work { parts, at: 0, next: 0.0, ends: true }
    }

    #[test]
    fn a_kind_of_which_nothing_is_done_takes_what_it_should_and_then_what_it_took() {
        let mut pace = Pace::default();
        for k in 0..10 {
            pace.at(f64::from(k), &three([f64::from(k), 10.0 - f64::from(k)], [0.0, 8.0]));
        }
        // One window at a second, eight records at half of it, and the coordinator.
        let told = left(&mut pace, 9.0, &three([9.0, 1.0], [0.0, 8.0]));
        assert!((told - 7.0).abs() < 1e-9, "{told}");
        // Two records took three seconds each: six more do, and the last window one.
        let told = left(&mut pace, 15.0, &three([9.0, 1.0], [2.0, 6.0]));
        assert!((told - (1.0 + 18.0 + 2.0)).abs() < 1e-9, "{told}");
    }

    #[test]
    fn what_is_open_has_a_share_and_no_end() {
        let mut pace = ten();
        let told = pace.at(11.0, &Work { ends: false, ..of(11.0) });
        assert!(told.left_s.is_none() && told.share.is_some(), "{told:?}");
        assert!((left(&mut pace, 12.0, &of(12.0)) - 18.0).abs() < 1e-9, "and is paced all the same");
    }

    #[test]
    fn a_batch_counts_as_far_as_it_is() {
        let mut pace = ten();
        let work = Work { next: 10.0, ..of(10.0) };
        let told = left(&mut pace, 15.0, &work.with_batch(0.5));
        assert!((told - 15.0).abs() < 1e-9, "{told}");
    }
}
