//! When one member crosses a level.
//!
//! Read next: `distribution.rs`.

use serde::{Deserialize, Serialize};

/// From which side a level is crossed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// The quantity rises above the level.
    Above,
    /// It falls below it.
    Below,
}

/// A level and the side from which it is crossed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Its value, in the unit of the quantity.
    pub value: f64,
    /// The side.
    pub direction: Direction,
}

impl Level {
    /// Above this value.
    pub fn above(value: f64) -> Self {
        Self { value, direction: Direction::Above }
    }

    /// Below this value.
    pub fn below(value: f64) -> Self {
        Self { value, direction: Direction::Below }
    }

    /// How far a value is beyond the level; positive beyond it.
    fn excess(self, value: f64) -> f64 {
        match self.direction {
            Direction::Above => value - self.value,
            Direction::Below => self.value - value,
        }
    }

    /// The first time at which a course is beyond the level, linear between its values; the first time of all where it begins
    /// there, none where it never gets there. Times increase, and there is one value for each.
    pub fn first_crossing(self, times: &[f64], values: &[f64]) -> Option<f64> {
        let k = values.iter().position(|value| self.excess(*value) > 0.0)?;
        if k == 0 {
            return times.first().copied();
        }
        let (before, after) = (self.excess(values[k - 1]), self.excess(values[k]));
        Some(times[k - 1] + (times[k] - times[k - 1]) * (-before / (after - before)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crossing_is_interpolated_between_rows() {
        let times = [0.0, 1.0, 3.0, 4.0];
        let near = |got: Option<f64>, want: f64| assert!((got.unwrap() - want).abs() < 1e-15, "{got:?}");
        near(Level::above(2.0).first_crossing(&times, &[0.0, 1.0, 5.0, 0.0]), 1.5);
        near(Level::below(-1.0).first_crossing(&times, &[0.0, 1.0, 1.0, -3.0]), 3.5);
        near(Level::above(2.0).first_crossing(&times, &[3.0, 1.0, 5.0, 0.0]), 0.0);
        assert_eq!(
            Level::above(9.0).first_crossing(&times, &[3.0, 1.0, 5.0, 9.0]),
            None,
            "touching is not crossing"
        );
        // A course that stands on the level and then leaves it crosses where it leaves.
        near(Level::above(1.0).first_crossing(&times, &[0.0, 1.0, 1.0, 2.0]), 3.0);
    }
}
