//! Long series become envelopes: the smallest and the largest value of every bucket of the axis, so no peak is lost.
//!
//! Next file to read: `drawing.rs`, which draws them, and `series.rs`, which keeps a finer one for the page's zoom.

use super::axis::Axis;

/// Series of at most this many samples are drawn as they are.
pub(crate) const PLAIN: usize = 1200;
/// Stretches of missing values shorter than this part of a long series do not part it: they are narrower than a pixel.
const BRIDGED: usize = 800;

/// One sample: a value (`lo` = `hi`) or the ends of a band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    pub(crate) t: f64,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

/// The series in parts without gaps; `lo` and `hi` are equal slices for a plain series. Not finite = missing = a gap.
pub(crate) fn parts(time: &[f64], lo: &[f64], hi: &[f64]) -> Vec<Vec<Sample>> {
    let n = time.len().min(lo.len()).min(hi.len());
    let bridged = if n > PLAIN { n / BRIDGED } else { 0 };
    let mut parts = vec![Vec::new()];
    let mut missing = 0;
    for k in 0..n {
        let sample = Sample { t: time[k], lo: lo[k], hi: hi[k] };
        if !(sample.t.is_finite() && sample.lo.is_finite() && sample.hi.is_finite()) {
            missing += 1;
            continue;
        }
        if missing > bridged {
            parts.push(Vec::new());
        }
        missing = 0;
        if let Some(last) = parts.last_mut() {
            last.push(sample);
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// A part as a curve.
pub(crate) fn curve(part: &[Sample]) -> Vec<(f64, f64)> {
    part.iter().map(|s| (s.t, s.lo)).collect()
}

/// A part as a band.
pub(crate) fn band(part: &[Sample]) -> Vec<(f64, f64, f64)> {
    part.iter().map(|s| (s.t, s.lo, s.hi)).collect()
}

/// Smallest and largest value in each of `n` buckets of equal width on the axis; `None` where a bucket has no sample. What
/// lies outside the axis is in the bucket at its end.
pub(crate) fn envelope(
    samples: impl Iterator<Item = (f64, f64, f64)>,
    axis: &Axis,
    n: usize,
) -> Vec<Option<(f64, f64)>> {
    let (first, last) = axis.ends();
    let mut buckets: Vec<Option<(f64, f64)>> = vec![None; n];
    for (t, lo, hi) in samples.filter(|s| s.0.is_finite() && s.1.is_finite() && s.2.is_finite()) {
        let share = (axis.at(t) - first) / (last - first);
        let at = ((share * n as f64).max(0.0) as usize).min(n.saturating_sub(1));
        if let Some(bucket) = buckets.get_mut(at) {
            *bucket = Some(bucket.map_or((lo, hi), |(a, b)| (a.min(lo), b.max(hi))));
        }
    }
    buckets
}

/// Whether a series is long enough to be drawn as an envelope, and in order of the axis; missing values do not count.
pub(crate) fn is_long(n: usize, x: impl Iterator<Item = f64>) -> bool {
    let mut known = x.filter(|t| t.is_finite());
    n > PLAIN && known.try_fold(f64::NEG_INFINITY, |last, t| (t >= last).then_some(t)).is_some()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]
    use super::*;

    #[test]
    fn a_long_series_keeps_its_extremes() {
        let mut value = vec![0.0; 100_000];
        value[54_321] = 7.0;
        value[12_345] = -3.0;
        let axis = Axis::tight("t", [0.0, 99_999.0]);
        let samples = value.iter().enumerate().map(|(k, v)| (k as f64, *v, *v));
        let buckets = envelope(samples, &axis, 700);
        assert_eq!(buckets.len(), 700);
        assert_eq!(buckets.iter().flatten().map(|b| b.1).fold(0.0, f64::max), 7.0);
        assert_eq!(buckets.iter().flatten().map(|b| b.0).fold(0.0, f64::min), -3.0);
        assert_eq!(buckets[(54_321 * 700) / 99_999], Some((0.0, 7.0)), "the peak stands where it was");
    }

    #[test]
    fn a_missing_value_parts_the_curve() {
        let value = [1.0, 2.0, f64::NAN, 4.0];
        let parts = parts(&[0.0, 1.0, 2.0, 3.0], &value, &value);
        assert_eq!(
            parts.iter().map(|p| curve(p)).collect::<Vec<_>>(),
            [vec![(0.0, 1.0), (1.0, 2.0)], vec![(3.0, 4.0)]]
        );
    }

    #[test]
    fn every_second_value_missing_leaves_a_long_series_whole() {
        let n = 10_000;
        let time: Vec<f64> = (0..n).map(f64::from).collect();
        let value: Vec<f64> = (0..n).map(|k| if k % 2 == 0 { 1.0 } else { f64::NAN }).collect();
        assert_eq!(parts(&time, &value, &value).len(), 1);
    }
}
