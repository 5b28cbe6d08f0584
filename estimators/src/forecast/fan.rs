//! Quantiles of an ensemble against time.
//!
//! Read next: `crossing.rs`.

use serde::{Deserialize, Serialize};

use super::{ForecastError, check, quantile};

/// Quantiles of all members at every time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fan {
    /// Times.
    pub times: Vec<f64>,
    /// Probabilities of the quantiles, increasing.
    pub probabilities: Vec<f64>,
    /// Values, one list per probability, one value per time.
    pub quantiles: Vec<Vec<f64>>,
}

impl Fan {
    /// The probabilities of a fan with its median and central intervals of 50, 80, 90 and 95 %.
    pub const USUAL: [f64; 9] = [0.025, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.975];

    /// Of an ensemble: one value per member and time.
    ///
    /// # Errors
    /// When there is no member or time, a member has another length, times do not increase or a value is not finite.
    pub fn of(times: &[f64], members: &[Vec<f64>], probabilities: &[f64]) -> Result<Self, ForecastError> {
        check(times, members)?;
        let mut quantiles = vec![Vec::with_capacity(times.len()); probabilities.len()];
        let mut column = vec![0.0; members.len()];
        for k in 0..times.len() {
            for (value, member) in column.iter_mut().zip(members) {
                *value = member[k];
            }
            column.sort_by(f64::total_cmp);
            for (values, p) in quantiles.iter_mut().zip(probabilities) {
                values.push(quantile(&column, *p));
            }
        }
        Ok(Self { times: times.to_vec(), probabilities: probabilities.to_vec(), quantiles })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fan_of_equally_spaced_members_has_their_quantiles_whatever_their_order() {
        let times = [0.0, 1.0, 2.0];
        let spread = |k: usize| times.iter().map(|t| t * k as f64).collect::<Vec<f64>>();
        let members: Vec<Vec<f64>> = [3, 0, 4, 1, 2].map(spread).into();
        let fan = Fan::of(&times, &members, &[0.1, 0.5, 1.0]).unwrap();
        for (row, per_time) in fan.quantiles.iter().zip([0.4, 2.0, 4.0]) {
            for (value, t) in row.iter().zip(times) {
                assert!((value - t * per_time).abs() < 1e-15, "{value}");
            }
        }
    }
}
