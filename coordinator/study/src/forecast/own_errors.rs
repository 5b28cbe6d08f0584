//! The errors of an output that was never fitted, from its own measured values.
//!
//! What was fitted leaves residuals; an output that was not leaves none, and a wrong model may fit the one and miss the other. The values
//! that were measured of it say by how much: beyond the spread of the members, E (y − m)² is the variance of its errors. So that no band
//! is judged by values that made it, the record is cut into stretches, and in each the errors are those outside it (cross-validation in
//! blocks, which errors that are correlated in time need: Burman, Chow & Nolan, *Biometrika* 1994). Next file to read:
//! [`super::ensemble`].

use super::ensemble::MeasuredValue;

/// Stretches of the record.
const STRETCHES: usize = 5;
/// Values below which they say nothing of their errors.
const FEWEST: usize = 20;

/// The errors outside each stretch, and all of them.
pub(super) struct OwnErrors {
    /// Times of the first values of the stretches but the first, and that of the last value.
    bounds: [f64; STRETCHES],
    /// Standard deviations: within each stretch, and after the last value.
    sd: [f64; STRETCHES + 1],
}

impl OwnErrors {
    /// Of values at times of the members' courses; `None` for fewer than 20. Values are in the order of time.
    pub(super) fn of(values: &[MeasuredValue], times: &[f64], courses: &[Vec<f64>]) -> Option<Self> {
        let n = values.len();
        if n < FEWEST || times.is_empty() || courses.is_empty() {
            return None;
        }
        let mut sums = [0.0; STRETCHES];
        let mut numbers = [0.0; STRETCHES];
        for (i, measured) in values.iter().enumerate() {
            let k = times.partition_point(|time| *time < measured.time).min(times.len() - 1);
            let stretch = i * STRETCHES / n;
            sums[stretch] += beyond_spread(measured.value, courses.iter().map(|course| course[k]));
            numbers[stretch] += 1.0;
        }
        let (all, number): (f64, f64) = (sums.iter().sum(), numbers.iter().sum());
        let sd = |square: f64, number: f64| (square / number).max(0.0).sqrt();
        let outside = |s: usize| sd(all - sums[s], number - numbers[s]);
        let first = |s: usize| (s * n).div_ceil(STRETCHES);
        Some(Self {
            bounds: std::array::from_fn(|s| values[first(s + 1).min(n - 1)].time),
            sd: std::array::from_fn(|s| if s < STRETCHES { outside(s) } else { sd(all, number) }),
        })
    }

    /// Standard deviation at a time, in the output's unit: from the values outside its stretch, or from all of them after the last.
    pub(super) fn at(&self, time: f64) -> f64 {
        let after = self.bounds.iter().take(STRETCHES - 1).filter(|bound| **bound <= time).count();
        let last = self.bounds[STRETCHES - 1];
        self.sd[if time > last { STRETCHES } else { after }]
    }

    /// Standard deviation of all values.
    pub(super) fn whole(&self) -> f64 {
        self.sd[STRETCHES]
    }
}

/// The square of what a value differs from the members' mean by, less the members' variance.
fn beyond_spread(value: f64, members: impl Iterator<Item = f64> + Clone) -> f64 {
    let (mut n, mut sum) = (0.0, 0.0);
    for member in members.clone() {
        (n, sum) = (n + 1.0, sum + member);
    }
    let mean = sum / n;
    let spread: f64 = members.map(|member| (member - mean).powi(2)).sum::<f64>() / n;
    (value - mean).powi(2) - spread
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(error: impl Fn(usize) -> f64) -> Vec<MeasuredValue> {
        (0..50).map(|i| MeasuredValue { time: i as f64, value: 1.0 + error(i), held_out: true }).collect()
    }

    #[test]
    fn a_stretch_has_the_errors_outside_it_and_what_comes_after_all_of_them() {
        let times: Vec<f64> = (0..60).map(f64::from).collect();
        // Members differ by one from their mean of one: their variance is one.
        let courses = vec![vec![0.0; 60], vec![2.0; 60]];
        let own = OwnErrors::of(&values(|i| if i < 10 { 5.0 } else { 2.0 }), &times, &courses).unwrap();
        // Squares are 25 in the first fifth and 4 in the others, one less each for the members.
        for (time, square) in [(0.0, 3.0), (9.0, 3.0), (10.0, 8.25), (49.0, 8.25), (50.0, 7.2)] {
            assert!((own.at(time).powi(2) - square).abs() < 1e-12, "{time}: {}", own.at(time));
        }
        assert!((own.whole().powi(2) - 7.2).abs() < 1e-12);
    }

    #[test]
    fn values_within_the_members_have_no_errors_and_few_values_say_nothing() {
        let times: Vec<f64> = (0..50).map(f64::from).collect();
        let courses = vec![vec![0.0; 50], vec![2.0; 50]];
        let own = OwnErrors::of(&values(|_| 0.5), &times, &courses).unwrap();
        assert!(own.whole().abs() < f64::EPSILON);
        assert!(OwnErrors::of(&values(|_| 0.5)[..19], &times, &courses).is_none());
    }
}
