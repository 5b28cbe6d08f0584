//! One axis: its label, its range and its ticks.

use super::super::number;

/// A tick: where it stands (already on the axis' own scale) and what it says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub(crate) at: f64,
    pub(crate) text: String,
}

/// A linear or logarithmic axis over a non-empty, finite range.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    pub(crate) label: String,
    /// Lower end, in the quantity's unit.
    pub(crate) lo: f64,
    /// Upper end, in the quantity's unit.
    pub(crate) hi: f64,
    log: bool,
}

impl Axis {
    /// An axis that just holds the finite `values`: for time.
    pub(crate) fn tight(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let (lo, hi) = finite_range(values).map_or((0.0, 1.0), widen);
        Self { label: label.to_owned(), lo, hi, log: false }
    }

    /// An axis that holds the finite `values` with a margin.
    pub(crate) fn around(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let (lo, hi) = finite_range(values).map_or((0.0, 1.0), widen);
        let margin = 0.06 * (hi - lo);
        Self { label: label.to_owned(), lo: lo - margin, hi: hi + margin, log: false }
    }

    /// A logarithmic axis with a margin; linear when a value is not positive.
    pub(crate) fn log_around(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        match finite_range(values) {
            Some((lo, hi)) if lo > 0.0 => {
                let margin = (hi / lo).powf(0.06).max(1.02);
                Self { label: label.to_owned(), lo: lo / margin, hi: hi * margin, log: true }
            }
            range => Self::around(label, range.map_or(Vec::new(), |(lo, hi)| vec![lo, hi])),
        }
    }

    /// The same axis with free space above the values, for words.
    pub(crate) fn with_headroom(mut self) -> Self {
        if !self.log {
            self.hi += 0.1 * (self.hi - self.lo);
        }
        self
    }

    /// Where a value stands on the axis.
    pub(crate) fn at(&self, value: f64) -> f64 {
        if self.log { value.max(f64::MIN_POSITIVE).log10() } else { value }
    }

    /// Both ends, on the axis' own scale.
    pub(crate) fn ends(&self) -> (f64, f64) {
        (self.at(self.lo), self.at(self.hi))
    }

    /// About `count` ticks at round values.
    pub(crate) fn ticks(&self, count: usize) -> Vec<Tick> {
        let tick = |value: f64, step: f64| Tick { at: self.at(value), text: number::tick(value, step) };
        if let Some(values) = self.log.then(|| log_values(self.lo, self.hi, count)).flatten() {
            return values.into_iter().map(|value| tick(value, value)).collect();
        }
        let values = linear_values(self.lo, self.hi, count);
        let step = values.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        values.into_iter().map(|value| tick(value, step)).collect()
    }
}

fn finite_range(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().filter(|v| v.is_finite()).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((lo, hi)) => Some((lo.min(v), hi.max(v))),
    })
}

/// A range of a single value becomes one with a width, so that there is an axis to draw.
fn widen((lo, hi): (f64, f64)) -> (f64, f64) {
    let least = 1e-9 * lo.abs().max(hi.abs()).max(1e-290);
    if hi - lo > least {
        return (lo, hi);
    }
    let half = if lo.abs() > 1e-290 { 0.05 * lo.abs() } else { 0.5 };
    (lo - half, hi + half)
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn linear_values(lo: f64, hi: f64, count: usize) -> Vec<f64> {
    let raw = (hi - lo) / count.max(1) as f64;
    let power = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].iter().map(|m| m * power).find(|step| *step >= raw).unwrap_or(raw);
    let first = (lo / step - 1e-9).ceil() as i64;
    let last = (hi / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// 1, 2, 5 of every decade, or whole decades when those are too many; `None` when fewer than three fall inside.
fn log_values(lo: f64, hi: f64, count: usize) -> Option<Vec<f64>> {
    let decades = (lo.log10().floor() as i32)..=(hi.log10().ceil() as i32);
    let inside = |v: &f64| *v >= lo * (1.0 - 1e-9) && *v <= hi * (1.0 + 1e-9);
    let every = |digits: &[f64], stride: usize| -> Vec<f64> {
        let powers = decades.clone().step_by(stride);
        powers.flat_map(|e| digits.iter().map(move |d| d * 10f64.powi(e))).filter(inside).collect()
    };
    let stride = decades.clone().count().div_ceil(count.max(1)).max(1);
    let candidates = [every(&[1.0, 2.0, 5.0], 1), every(&[1.0], 1), every(&[1.0], stride)];
    candidates.into_iter().find(|values| values.len() >= 3 && values.len() <= count + 2)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]
    use super::*;

    fn texts(axis: &Axis, count: usize) -> Vec<String> {
        axis.ticks(count).into_iter().map(|t| t.text).collect()
    }

    #[test]
    fn ticks_of_a_linear_axis_are_round_and_lie_inside() {
        assert_eq!(texts(&Axis::tight("t", [0.0, 4.2]), 5), ["0", "1", "2", "3", "4"]);
        assert_eq!(texts(&Axis::tight("t", [0.0, 0.9]), 5), ["0.0", "0.2", "0.4", "0.6", "0.8"]);
    }

    #[test]
    fn ticks_of_a_logarithmic_axis_follow_the_decades() {
        assert_eq!(texts(&Axis::log_around("R", [0.1, 10.0]), 7), ["0.1", "0.2", "0.5", "1", "2", "5", "10"]);
        assert_eq!(texts(&Axis::log_around("R", [1.5, 4.0]), 5), ["2", "3", "4"]);
    }

    #[test]
    fn a_range_without_values_or_of_one_value_still_has_a_width() {
        for axis in [Axis::tight("t", []), Axis::tight("t", [f64::NAN]), Axis::around("t", [3.0, 3.0])] {
            assert!(axis.hi > axis.lo, "{axis:?}");
        }
        assert_eq!(Axis::around("t", [0.0]).at(0.5), 0.5);
    }
}
