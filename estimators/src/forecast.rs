//! What an ensemble of runs says of the future: a fan of quantiles, and the distribution of the time at which a quantity crosses a
//! level.
//!
//! The members are whatever the caller has run; where they come from, a posterior or noise, is not known here. The order of the
//! files is `forecast/crossing.rs` (one member), `forecast/distribution.rs` (all of them), `forecast/fan.rs`, `forecast/central.rs`.

mod central;
mod crossing;
mod distribution;
mod fan;

pub use central::central95;
pub use crossing::{Direction, Level};
pub use distribution::Crossings;
pub use fan::Fan;

/// Why an ensemble gives no forecast.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForecastError {
    /// There is no member or no time.
    #[error("a forecast needs at least one member and one time: {n_member} members, {n_time} times")]
    Empty {
        /// Members given.
        n_member: usize,
        /// Times given.
        n_time: usize,
    },
    /// A member has another number of values than there are times.
    #[error("member {member} has {got} values for {expected} times")]
    Shape {
        /// The member, from 0.
        member: usize,
        /// Times given.
        expected: usize,
        /// Values of the member.
        got: usize,
    },
    /// Times that do not increase.
    #[error("time {at} of a forecast, {time}, is not a number above the one before")]
    Times {
        /// Its number, from 0.
        at: usize,
        /// The time.
        time: f64,
    },
    /// A value that is not a finite number.
    #[error("member {member} is {value} at time {time}: it must be a finite number")]
    NotFinite {
        /// The member, from 0.
        member: usize,
        /// Its time.
        time: f64,
        /// The value.
        value: f64,
    },
}

/// Refuses an ensemble that is none: `members` hold one value per time.
fn check(times: &[f64], members: &[Vec<f64>]) -> Result<(), ForecastError> {
    if times.is_empty() || members.is_empty() {
        return Err(ForecastError::Empty { n_member: members.len(), n_time: times.len() });
    }
    let first = (!times[0].is_finite()).then_some(0);
    let later = || (1..times.len()).find(|k| !(times[*k].is_finite() && times[*k] > times[k - 1]));
    if let Some(at) = first.or_else(later) {
        return Err(ForecastError::Times { at, time: times[at] });
    }
    for (member, values) in members.iter().enumerate() {
        if values.len() != times.len() {
            return Err(ForecastError::Shape { member, expected: times.len(), got: values.len() });
        }
        if let Some(k) = values.iter().position(|v| !v.is_finite()) {
            return Err(ForecastError::NotFinite { member, time: times[k], value: values[k] });
        }
    }
    Ok(())
}

/// The quantile of sorted values at probability `p`, linear between order statistics (Hyndman and Fan 1996, definition 7).
fn quantile(sorted: &[f64], p: f64) -> f64 {
    let at = p.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let k = (at.floor() as usize).min(sorted.len() - 1);
    let next = sorted[(k + 1).min(sorted.len() - 1)];
    sorted[k] + (at - k as f64) * (next - sorted[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_linear_between_order_statistics() {
        let sorted = [1.0, 2.0, 4.0, 8.0, 16.0];
        for (p, want) in [(0.0, 1.0), (0.25, 2.0), (0.5, 4.0), (0.625, 6.0), (1.0, 16.0), (7.0, 16.0)] {
            assert!((quantile(&sorted, p) - want).abs() < 1e-15, "{p}");
        }
        assert!((quantile(&[3.0], 0.3) - 3.0).abs() < 1e-15);
    }

    #[test]
    fn an_ensemble_that_is_none_is_refused() {
        let times = [0.0, 1.0];
        assert_eq!(check(&times, &[]), Err(ForecastError::Empty { n_member: 0, n_time: 2 }));
        assert_eq!(check(&[0.0, 0.0], &[vec![1.0; 2]]), Err(ForecastError::Times { at: 1, time: 0.0 }));
        let short = Err(ForecastError::Shape { member: 1, expected: 2, got: 1 });
        assert_eq!(check(&times, &[vec![1.0; 2], vec![1.0]]), short);
        let said = check(&times, &[vec![1.0, f64::NAN]]).map_err(|error| error.to_string());
        assert_eq!(said, Err("member 0 is NaN at time 1: it must be a finite number".to_owned()));
    }
}
