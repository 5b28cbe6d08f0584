//! The distribution of the time at which the members of an ensemble cross a level.
//!
//! Members that never cross within the times of the forecast count: they are beyond every time. Read next: `fan.rs`.

use serde::{Deserialize, Serialize};

use super::{ForecastError, Level, check};

/// First crossings of all members.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Crossings {
    /// The level.
    pub level: Level,
    /// Last time of the forecast.
    pub until: f64,
    /// Number of members.
    pub n_member: usize,
    /// Times of those that cross, sorted.
    pub times: Vec<f64>,
}

impl Crossings {
    /// Of an ensemble: one value per member and time.
    ///
    /// # Errors
    /// When there is no member or time, a member has another length, times do not increase or a value is not finite.
    pub fn of(times: &[f64], members: &[Vec<f64>], level: Level) -> Result<Self, ForecastError> {
        check(times, members)?;
        let mut crossed: Vec<f64> =
            members.iter().filter_map(|values| level.first_crossing(times, values)).collect();
        crossed.sort_by(f64::total_cmp);
        Ok(Self { level, until: times[times.len() - 1], n_member: members.len(), times: crossed })
    }

    /// Number of members that never cross.
    pub fn n_never(&self) -> usize {
        self.n_member - self.times.len()
    }

    /// Share of the members that have crossed by a time.
    pub fn probability_by(&self, time: f64) -> f64 {
        self.times.partition_point(|t| *t <= time) as f64 / self.n_member as f64
    }

    /// The time by which a share `p` of all members has crossed, linear between order statistics; none where it lies among the
    /// members that never cross.
    pub fn quantile(&self, p: f64) -> Option<f64> {
        let at = p.clamp(0.0, 1.0) * (self.n_member - 1) as f64;
        let k = at.floor() as usize;
        let (from, rest) = (*self.times.get(k)?, at - k as f64);
        // Where the place is an order statistic to rounding, the next one does not matter.
        if rest <= 1e-12 * at {
            return Some(from);
        }
        self.times.get(k + 1).map(|to| from + rest * (to - from))
    }

    /// The median, over all members.
    pub fn median(&self) -> Option<f64> {
        self.quantile(0.5)
    }

    /// The smallest and largest time of the central share `level` of all members.
    pub fn interval(&self, level: f64) -> Option<[f64; 2]> {
        let half = 0.5 * (1.0 - level);
        Some([self.quantile(half)?, self.quantile(1.0 - half)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight lines from zero that pass one at 1, 2, ..., `n`.
    fn lines(n: usize, until: f64) -> Crossings {
        let times: Vec<f64> = (0..=400).map(|k| until * f64::from(k) / 400.0).collect();
        let members: Vec<Vec<f64>> = (1..=n).map(|i| times.iter().map(|t| t / i as f64).collect()).collect();
        Crossings::of(&times, &members, Level::above(1.0)).unwrap()
    }

    #[test]
    fn straight_lines_cross_when_they_do_and_quantiles_are_those_of_their_times() {
        let crossings = lines(5, 20.0);
        let near =
            |got: Option<f64>, want: f64| assert!((got.unwrap() - want).abs() < 1e-12, "{got:?} {want}");
        for (k, t) in crossings.times.iter().enumerate() {
            near(Some(*t), k as f64 + 1.0);
        }
        near(crossings.median(), 3.0);
        near(crossings.quantile(0.125), 1.5);
        let [lo, hi] = crossings.interval(0.5).unwrap();
        near(Some(lo), 2.0);
        near(Some(hi), 4.0);
        assert!((crossings.probability_by(3.5) - 0.6).abs() < 1e-15 && crossings.n_never() == 0);
    }

    #[test]
    fn members_that_never_cross_are_counted_beyond_every_time() {
        let crossings = lines(10, 4.5);
        assert_eq!((crossings.times.len(), crossings.n_never()), (4, 6));
        assert!((crossings.probability_by(1e9) - 0.4).abs() < 1e-15);
        assert_eq!(crossings.median(), None, "more than half never cross");
        assert!((crossings.quantile(3.0 / 9.0).unwrap() - 4.0).abs() < 1e-12);
        assert_eq!(
            crossings.quantile(0.35),
            None,
            "between the last that crosses and the first that does not"
        );
        let none = lines(3, 0.5);
        assert!(
            none.times.is_empty() && none.quantile(0.0).is_none() && none.probability_by(0.5) < f64::EPSILON
        );
    }
}
