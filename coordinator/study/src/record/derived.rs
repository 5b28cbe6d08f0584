//! Channels whose column holds the rate or the integral of the output: a displacement from velocity data, a velocity from
//! displacement data.
//!
//! A value that is fitted is made of values of the training span alone: what is held out stays unseen. Either way the errors
//! of neighbouring values are no longer independent, which a warning says. Next file to read: [`super::channel`].

use super::reader::ChannelReader;
use crate::file::ChannelSection;

/// What a column holds of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Derived {
    /// The output itself.
    Itself,
    /// Its rate: integrated by the trapezoidal rule from this value at the first value of the training span.
    Rate { start: f64 },
    /// Its integral: differentiated by centred differences.
    Integral,
}

impl Derived {
    /// The output's values from the column's; NaN where they cannot be computed. `used` says which rows count for the fit.
    pub(super) fn values(self, times: &[f64], column: &[f64], used: &[bool]) -> Vec<f64> {
        match self {
            Self::Itself => column.to_vec(),
            Self::Rate { start } => {
                both_ways(times, column, used, |times, rate| integrate(times, rate, start))
            }
            Self::Integral => differentiate(times, column, used),
        }
    }

    /// Standard deviation of every derived value for independent errors of the column with standard deviation 1; NaN where
    /// there is no value.
    pub(super) fn spread(self, times: &[f64], column: &[f64], used: &[bool]) -> Vec<f64> {
        match self {
            Self::Itself => column.iter().map(|v| if v.is_finite() { 1.0 } else { f64::NAN }).collect(),
            Self::Rate { .. } => both_ways(times, column, used, spread_of_integral),
            Self::Integral => {
                let width = |k: usize| times[k + 1] - times[k - 1];
                let known = differentiate(times, column, used);
                let at = |(k, v): (usize, f64)| if v.is_finite() { 2.0_f64.sqrt() / width(k) } else { v };
                known.into_iter().enumerate().map(at).collect()
            }
        }
    }
}

/// Applies a rule that sums from its first value on: forwards from the first value that counts, and backwards to the rows
/// before it, so that no row that counts depends on those before.
fn both_ways(
    times: &[f64],
    column: &[f64],
    used: &[bool],
    rule: impl Fn(&[f64], &[f64]) -> Vec<f64>,
) -> Vec<f64> {
    let first = column.iter().zip(used).position(|(v, used)| *used && v.is_finite()).unwrap_or(0);
    let reversed = |values: &[f64]| -> Vec<f64> { values[..=first].iter().rev().copied().collect() };
    if column.is_empty() {
        return Vec::new();
    }
    let mut values = rule(&reversed(times), &reversed(column));
    values.reverse();
    values.truncate(first);
    values.extend(rule(&times[first..], &column[first..]));
    values
}

/// ∫ from the first value, linear across missing values.
fn integrate(times: &[f64], rate: &[f64], start: f64) -> Vec<f64> {
    let mut sum = start;
    let mut previous: Option<(f64, f64)> = None;
    let mut integral = Vec::with_capacity(times.len());
    for (&t, &v) in times.iter().zip(rate) {
        if v.is_nan() {
            integral.push(f64::NAN);
            continue;
        }
        if let Some((t0, v0)) = previous {
            sum += 0.5 * (t - t0) * (v0 + v);
        }
        previous = Some((t, v));
        integral.push(sum);
    }
    integral
}

/// Root of the sum of squared trapezoidal weights up to each value.
fn spread_of_integral(times: &[f64], rate: &[f64]) -> Vec<f64> {
    // `inner` sums the squared weights of all values before the last; the first and the last weigh half a step.
    let (mut inner, mut last_step) = (0.0, 0.0);
    let mut previous: Option<f64> = None;
    let mut spread = Vec::with_capacity(times.len());
    for (&t, &v) in times.iter().zip(rate) {
        if v.is_nan() {
            spread.push(f64::NAN);
            continue;
        }
        if let Some(t0) = previous {
            let step = t - t0;
            inner += (0.5_f64 * (last_step + step)).powi(2);
            last_step = step;
        }
        previous = Some(t);
        spread.push(0.25_f64.mul_add(last_step * last_step, inner).sqrt());
    }
    spread
}

/// Centred differences; NaN at both ends, beside a missing value, and on a row that counts beside one that does not.
fn differentiate(times: &[f64], values: &[f64], used: &[bool]) -> Vec<f64> {
    let centred = |k: usize| {
        if k == 0 || k + 1 >= values.len() || (used[k] && !(used[k - 1] && used[k + 1])) {
            return f64::NAN;
        }
        (values[k + 1] - values[k - 1]) / (times[k + 1] - times[k - 1])
    };
    (0..values.len()).map(centred).collect()
}

impl ChannelReader<'_> {
    /// What the column holds; `None` when a problem was reported.
    pub(super) fn derived(&self, section: &ChannelSection) -> Option<Derived> {
        let start = section.start.as_ref();
        let derived = match section.from.as_ref().map(|from| (from, from.get_ref().as_str())) {
            None => Derived::Itself,
            Some((_, "rate")) => return Some(Derived::Rate { start: start.map_or(0.0, |s| *s.get_ref()) }),
            Some((_, "integral")) => Derived::Integral,
            Some((from, other)) => {
                let valid = ["rate", "integral"].map(str::to_owned);
                let message = format!("a column cannot hold the `{other}` of an output");
                self.source.report_unknown(from.span(), message, &valid);
                return None;
            }
        };
        if let Some(start) = start {
            let help = "remove it, or say that the column holds a rate, by from = \"rate\"";
            self.source.report_with(start.span(), "`start` is the value at which an integral begins", help);
            return None;
        }
        Some(derived)
    }

    /// The output's values from the column's at every row.
    pub(super) fn derive(&self, derived: Derived, column: &[f64]) -> Vec<f64> {
        derived.values(&self.table.times, column, &self.rows_used())
    }

    fn rows_used(&self) -> Vec<bool> {
        self.table.times.iter().map(|t| self.is_used(*t)).collect()
    }

    /// Root mean square of the standard deviations where the channel counts, and the last of them.
    pub(super) fn spread(&self, derived: Derived, column: &[f64]) -> (f64, f64) {
        let spread = self.used(&derived.spread(&self.table.times, column, &self.rows_used()));
        let known: Vec<f64> = spread.into_iter().filter(|s| s.is_finite()).collect();
        let sum: f64 = known.iter().map(|s| s * s).sum();
        ((sum / known.len().max(1) as f64).sqrt(), known.last().copied().unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAN: f64 = f64::NAN;

    #[test]
    fn a_linear_rate_integrates_exactly_also_across_a_missing_value() {
        let times = [0.0, 0.5, 1.0, 2.0];
        let integral = Derived::Rate { start: 3.0 }.values(&times, &[0.0, 1.0, NAN, 4.0], &[true; 4]);
        // The rate is 2t: 3 + t².
        for (found, wanted) in integral.iter().zip([3.0, 3.25, NAN, 7.0]) {
            assert!((found - wanted).abs() < 1e-15 || (found.is_nan() && wanted.is_nan()), "{integral:?}");
        }
    }

    #[test]
    fn the_error_of_an_integral_grows_with_the_root_of_time() {
        let times: Vec<f64> = (0..101).map(|k| 0.1 * f64::from(k)).collect();
        let spread = Derived::Rate { start: 0.0 }.spread(&times, &[1.0; 101], &[true; 101]);
        // n steps of h: h √(n − 1/2), from the weights h/2, h, …, h, h/2; rounding of 0.1 sums.
        for n in [1, 2, 100] {
            let wanted = 0.1 * (f64::from(n) - 0.5).sqrt();
            assert!((spread[n as usize] - wanted).abs() < 1e-12, "{n}: {}", spread[n as usize]);
        }
    }

    #[test]
    fn a_parabola_differentiates_exactly_but_not_at_its_ends() {
        let times = [0.0, 1.0, 2.0, 3.0, 4.0];
        let rate = Derived::Integral.values(&times, &[0.0, 1.0, 4.0, 9.0, 16.0], &[true; 5]);
        assert_eq!(format!("{rate:?}"), "[NaN, 2.0, 4.0, 6.0, NaN]");
        let spread = Derived::Integral.spread(&times, &[0.0, NAN, 4.0, 9.0, 16.0], &[true; 5]);
        assert_eq!(format!("{spread:.4?}"), "[NaN, 0.7071, NaN, 0.7071, NaN]");
    }

    #[test]
    fn no_row_that_counts_depends_on_one_that_does_not() {
        let times = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let used = [false, false, true, true, true, false, false];
        let column = [1.0, 2.0, 3.0, 5.0, 4.0, 2.0, 1.0];
        let spoilt = [70.0, -80.0, 3.0, 5.0, 4.0, NAN, 90.0];
        for derived in [Derived::Rate { start: 0.5 }, Derived::Integral] {
            let counted = |column: &[f64]| {
                let values = derived.values(&times, column, &used);
                let spread = derived.spread(&times, column, &used);
                format!("{:?} {:?}", &values[2..5], &spread[2..5])
            };
            assert_eq!(counted(&column), counted(&spoilt));
        }
        let integral = Derived::Rate { start: 0.5 }.values(&times, &column, &used);
        // Halves are exact, also as text; the rows before the span lead to its first value.
        assert_eq!(format!("{integral:?}"), "[-3.5, -2.0, 0.5, 4.5, 9.0, 12.0, 13.5]");
        let rate = Derived::Integral.values(&times, &column, &used);
        assert_eq!(format!("{:?}", &rate[2..5]), "[NaN, 0.5, NaN]");
    }
}
