//! One axis: its label, its range and its ticks.
//!
//! Whatever the values are, the ends are finite, the range has a width and the ticks are few. Ticks are round
//! numbers, also on short logarithmic axes.

use super::super::number;

/// Values beyond ± this stand at the edge of an axis, so that no range and no margin overflows.
const LARGEST: f64 = 1e300;
/// Positive values below this stand at the edge of a logarithmic axis.
const SMALLEST: f64 = 1e-300;
/// A bar this many times as high as another asks for a logarithmic axis.
const SLIVER: f64 = 40.0;
/// No axis has more ticks than this, whatever is asked.
const MOST: usize = 50;

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
    scale: Scale,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scale {
    Linear,
    /// Linear, with ticks at whole numbers only.
    Whole,
    Logarithmic,
}

impl Axis {
    /// An axis that just holds the finite `values`: for time.
    pub(crate) fn tight(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let (lo, hi) = finite_range(values).map_or((0.0, 1.0), widen);
        Self { label: label.to_owned(), lo, hi, scale: Scale::Linear }
    }

    /// As [`Axis::tight`], for what happened step by step: where every value is whole, as iterations are, so is every tick.
    pub(crate) fn over_run(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        let whole = !values.is_empty() && values.iter().all(|v| v.fract().abs() <= 0.0);
        let scale = if whole { Scale::Whole } else { Scale::Linear };
        Self { scale, ..Self::tight(label, values) }
    }

    /// An axis over whole numbers, each with half of the room to its neighbours.
    pub(crate) fn counted(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let (lo, hi) = finite_range(values).unwrap_or((0.0, 1.0));
        let (lo, hi) = widen((lo - 0.5, hi + 0.5));
        Self { label: label.to_owned(), lo, hi, scale: Scale::Whole }
    }

    /// An axis that holds the finite `values` with a margin.
    pub(crate) fn around(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let (lo, hi) = finite_range(values).map_or((0.0, 1.0), widen);
        let margin = 0.06 * (hi - lo);
        Self { label: label.to_owned(), lo: lo - margin, hi: hi + margin, scale: Scale::Linear }
    }

    /// A logarithmic axis with a margin; linear when a value is not positive.
    pub(crate) fn log_around(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        match finite_range(values) {
            Some((lo, hi)) if lo > 0.0 => {
                let (lo, hi) = (lo.clamp(SMALLEST, LARGEST), hi.clamp(SMALLEST, LARGEST));
                // As a difference of logarithms: the ratio itself may overflow.
                let margin = (0.06 * (hi.ln() - lo.ln())).exp().max(1.02);
                let (lo, hi) = ((lo / margin).max(SMALLEST), (hi * margin).min(LARGEST));
                Self { label: label.to_owned(), lo, hi, scale: Scale::Logarithmic }
            }
            range => Self::around(label, range.map_or(Vec::new(), |(lo, hi)| vec![lo, hi])),
        }
    }

    /// An axis for bars that stand on it, as high as something was counted: logarithmic where the highest would make slivers of the
    /// lowest.
    pub(crate) fn counts(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let counted: Vec<f64> = values.into_iter().filter(|v| v.is_finite() && *v > 0.0).collect();
        let highest = counted.iter().copied().fold(1.0, f64::max).min(LARGEST);
        let lowest = counted.iter().copied().fold(highest, f64::min);
        let (lo, hi, scale) = if highest > SLIVER * lowest {
            (0.5 * lowest, 1.3 * highest, Scale::Logarithmic)
        } else {
            (0.0, 1.1 * highest, Scale::Whole)
        };
        Self { label: label.to_owned(), lo, hi, scale }
    }

    /// The same axis with free space above the values, for words.
    pub(crate) fn with_headroom(mut self) -> Self {
        if self.scale != Scale::Logarithmic {
            self.hi += 0.1 * (self.hi - self.lo);
        }
        self
    }

    /// Whether it is logarithmic.
    pub(crate) fn is_log(&self) -> bool {
        self.scale == Scale::Logarithmic
    }

    /// Where a value stands on the axis.
    pub(crate) fn at(&self, value: f64) -> f64 {
        if self.scale == Scale::Logarithmic { value.max(f64::MIN_POSITIVE).log10() } else { value }
    }

    /// The value that stands at a share of the axis' length, 0 at its lower end and 1 at its upper one.
    pub(crate) fn value_at(&self, share: f64) -> f64 {
        let (lo, hi) = self.ends();
        // Weighted ends, because the difference of the largest numbers overflows.
        let at = (1.0 - share) * lo + share * hi;
        if self.scale == Scale::Logarithmic { 10f64.powf(at) } else { at }
    }

    /// Both ends, on the axis' own scale.
    pub(crate) fn ends(&self) -> (f64, f64) {
        (self.at(self.lo), self.at(self.hi))
    }

    /// About `count` ticks at round values.
    pub(crate) fn ticks(&self, count: usize) -> Vec<Tick> {
        let count = count.clamp(1, MOST);
        let tick = |value: f64, step: f64| Tick { at: self.at(value), text: number::tick(value, step) };
        if self.scale == Scale::Logarithmic
            && let Some(values) = log_values(self.lo, self.hi, count)
        {
            return values.into_iter().map(|value| tick(value, value)).collect();
        }
        let least = if self.scale == Scale::Whole { 1.0 } else { 0.0 };
        let (step, values) = linear_values(self.lo, self.hi, count, least);
        values.into_iter().map(|value| tick(value, step)).collect()
    }
}

fn finite_range(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|v| v.is_finite()).map(|v| v.clamp(-LARGEST, LARGEST));
    finite.fold(None, |range, v| match range {
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

/// Multiples of a step of 1, 2 or 5 times a power of ten, and that step; it is at least `least`.
fn linear_values(lo: f64, hi: f64, count: usize, least: f64) -> (f64, Vec<f64>) {
    let raw = ((hi - lo) / count as f64).max(least);
    let power = 10f64.powf((raw.log10() + 1e-12).floor());
    let step = [1.0, 2.0, 5.0, 10.0].iter().map(|m| m * power).find(|step| *step >= raw).unwrap_or(raw);
    let first = (lo / step - 1e-9).ceil();
    let last = (hi / step + 1e-9).floor();
    // Counted from the first one: its multiple of the step may be beyond every integer type.
    let n = if last >= first { (last - first) as usize + 1 } else { 0 };
    (step, (0..n.min(MOST)).map(|k| (first + k as f64) * step).collect())
}

/// 1, 2, 5 of every decade, or whole decades when those are too many; `None` when fewer than three fall inside.
fn log_values(lo: f64, hi: f64, count: usize) -> Option<Vec<f64>> {
    let (first, last) = (lo.log10().floor() as i32, hi.log10().ceil() as i32);
    let inside = |v: &f64| *v >= lo * (1.0 - 1e-9) && *v <= hi * (1.0 + 1e-9);
    let every = |digits: &[f64], stride: i32| -> Vec<f64> {
        let powers = (first..=last).filter(|e| e.rem_euclid(stride) == 0);
        powers.flat_map(|e| digits.iter().map(move |d| d * 10f64.powi(e))).filter(inside).collect()
    };
    let few = |stride: &i32| ((last - first) / stride).unsigned_abs() as usize <= count;
    let stride = [1, 2, 3, 5, 10, 20, 30, 50, 100].into_iter().find(few).unwrap_or(200);
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

    /// Every way to make an axis, over the same values.
    fn every_kind(values: &[f64]) -> [Axis; 5] {
        let values = || values.iter().copied();
        [
            Axis::tight("x", values()),
            Axis::over_run("x", values()),
            Axis::counted("x", values()),
            Axis::around("x", values()).with_headroom(),
            Axis::log_around("x", values()).with_headroom(),
        ]
    }

    #[test]
    fn no_values_make_an_axis_endless_empty_or_crowded() {
        let (inf, nan, tiny) = (f64::INFINITY, f64::NAN, f64::from_bits(1));
        for values in [
            vec![],
            vec![1e-200, 1e200],
            vec![tiny, f64::MAX],
            vec![f64::MIN_POSITIVE, 1.0],
            vec![tiny, 2.0 * tiny],
            vec![tiny],
            vec![-f64::MAX, f64::MAX],
            vec![f64::MAX, f64::MAX],
            vec![nan, inf, -inf],
            vec![inf, 3.0, nan],
            vec![7.0; 3],
            vec![0.0; 2],
            vec![-0.0],
            vec![1e18, 1e18 + 1e3],
            vec![1.0, 1.0 + f64::EPSILON],
        ] {
            for axis in every_kind(&values) {
                let (lo, hi) = axis.ends();
                assert!(axis.lo.is_finite() && axis.hi.is_finite() && axis.lo < axis.hi, "{axis:?}");
                assert!((hi - lo).is_finite() && hi > lo, "{axis:?}");
                for count in [0, 1, 5, 7, usize::MAX] {
                    let ticks = axis.ticks(count);
                    // A step rounded up to 1, 2 or 5 leaves at most one tick more than asked, and one at each end.
                    assert!(ticks.len() <= count.clamp(1, MOST) + 2, "{axis:?}: {ticks:?}");
                    assert!(ticks.iter().all(|t| t.at.is_finite() && t.text != number::ABSENT), "{ticks:?}");
                    assert!(ticks.windows(2).all(|pair| pair[0].at < pair[1].at), "{axis:?}: {ticks:?}");
                }
            }
        }
    }

    #[test]
    fn hundreds_of_decades_have_round_ticks() {
        let axis = Axis::log_around("R", [1e-200, 1e200]);
        let expected = ["1×10⁻²⁰⁰", "1×10⁻¹⁰⁰", "1", "1×10¹⁰⁰", "1×10²⁰⁰"];
        assert_eq!(texts(&axis, 5), expected);
    }

    #[test]
    fn an_axis_of_a_few_iterations_shows_whole_numbers_only() {
        assert_eq!(texts(&Axis::over_run("iteration", [1.0, 2.0, 3.0]), 6), ["1", "2", "3"]);
        assert_eq!(texts(&Axis::over_run("iteration", [1.0, 2.0]), 6), ["1", "2"]);
        assert_eq!(texts(&Axis::over_run("iteration", [1.0]), 6), ["1"]);
        assert_eq!(
            texts(&Axis::over_run("iteration", (1..=11).map(f64::from)), 6),
            ["2", "4", "6", "8", "10"]
        );
        assert_eq!(
            texts(&Axis::over_run("time [s]", [0.0, 0.5, 1.0]), 5),
            ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]
        );
    }
}
