//! Channels whose column holds the rate or the integral of the output: a displacement from velocity data, a velocity from
//! displacement data.
//!
//! Either way the errors of neighbouring values are no longer independent, which a warning says. Next file to read:
//! [`super::channel`].

use super::channel::ChannelReader;
use crate::study::file::ChannelSection;

/// What a column holds of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Derived {
    /// The output itself.
    Itself,
    /// Its rate: integrated by the trapezoidal rule from this value at the first measured time.
    Rate { start: f64 },
    /// Its integral: differentiated by centred differences.
    Integral,
}

impl Derived {
    /// The output's values from the column's; NaN where they cannot be told.
    pub(super) fn values(self, times: &[f64], column: &[f64]) -> Vec<f64> {
        match self {
            Self::Itself => column.to_vec(),
            Self::Rate { start } => integrate(times, column, start),
            Self::Integral => differentiate(times, column),
        }
    }

    /// Standard deviation of every derived value for independent errors of the column with standard deviation 1; NaN where
    /// there is no value.
    pub(super) fn spread(self, times: &[f64], column: &[f64]) -> Vec<f64> {
        match self {
            Self::Itself => column.iter().map(|v| if v.is_finite() { 1.0 } else { f64::NAN }).collect(),
            Self::Rate { .. } => spread_of_integral(times, column),
            Self::Integral => {
                let width = |k: usize| times[k + 1] - times[k - 1];
                let known = differentiate(times, column);
                let at = |(k, v): (usize, f64)| if v.is_finite() { 2.0_f64.sqrt() / width(k) } else { v };
                known.into_iter().enumerate().map(at).collect()
            }
        }
    }
}

/// ∫ from the first measured time, linear across missing values.
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

/// Centred differences; NaN at both ends and beside a missing value.
fn differentiate(times: &[f64], values: &[f64]) -> Vec<f64> {
    let centred = |k: usize| {
        if k == 0 || k + 1 >= values.len() {
            return f64::NAN;
        }
        (values[k + 1] - values[k - 1]) / (times[k + 1] - times[k - 1])
    };
    (0..values.len()).map(centred).collect()
}

impl ChannelReader<'_> {
    /// What the column holds; nothing after a complaint.
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

    /// Root mean square of the standard deviations where the channel counts, and the last of them.
    pub(super) fn spread(&self, derived: Derived, column: &[f64]) -> (f64, f64) {
        let spread = self.used(&derived.spread(&self.table.times, column));
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
        let integral = Derived::Rate { start: 3.0 }.values(&times, &[0.0, 1.0, NAN, 4.0]);
        // The rate is 2t: 3 + t².
        for (found, wanted) in integral.iter().zip([3.0, 3.25, NAN, 7.0]) {
            assert!((found - wanted).abs() < 1e-15 || (found.is_nan() && wanted.is_nan()), "{integral:?}");
        }
    }

    #[test]
    fn the_error_of_an_integral_grows_with_the_root_of_time() {
        let times: Vec<f64> = (0..101).map(|k| 0.1 * f64::from(k)).collect();
        let spread = Derived::Rate { start: 0.0 }.spread(&times, &[1.0; 101]);
        // n steps of h: h √(n − 1/2), from the weights h/2, h, …, h, h/2; rounding of 0.1 sums.
        for n in [1, 2, 100] {
            let wanted = 0.1 * (f64::from(n) - 0.5).sqrt();
            assert!((spread[n as usize] - wanted).abs() < 1e-12, "{n}: {}", spread[n as usize]);
        }
    }

    #[test]
    fn a_parabola_differentiates_exactly_but_not_at_its_ends() {
        let times = [0.0, 1.0, 2.0, 3.0, 4.0];
        let rate = Derived::Integral.values(&times, &[0.0, 1.0, 4.0, 9.0, 16.0]);
        assert_eq!(format!("{rate:?}"), "[NaN, 2.0, 4.0, 6.0, NaN]");
        let spread = Derived::Integral.spread(&times, &[0.0, NAN, 4.0, 9.0, 16.0]);
        assert_eq!(format!("{spread:.4?}"), "[NaN, 0.7071, NaN, 0.7071, NaN]");
    }
}
