//! Long series become envelopes: the smallest and the largest value of every bucket of samples, so no peak is lost.
//!
//! Our own because plotters draws every point that it is given.

/// Series of at most this many samples are drawn as they are.
const PLAIN: usize = 900;
/// Buckets of an envelope: about one per device pixel of a figure.
const BUCKETS: usize = 400;

/// One drawn sample: a value (`lo` = `hi`) or the range of a bucket.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    pub(crate) t: f64,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

/// The series in parts without gaps; `lo` and `hi` are equal slices for a plain series. Not finite = missing = a gap.
pub(crate) fn parts(time: &[f64], lo: &[f64], hi: &[f64]) -> Vec<Vec<Sample>> {
    let n = time.len().min(lo.len()).min(hi.len());
    let stride = if n > PLAIN { n.div_ceil(BUCKETS) } else { 1 };
    let mut parts = vec![Vec::new()];
    for start in (0..n).step_by(stride) {
        let end = (start + stride).min(n);
        match bucket(&time[start..end], &lo[start..end], &hi[start..end]) {
            Some(sample) => {
                if let Some(last) = parts.last_mut() {
                    last.push(sample);
                }
            }
            None => parts.push(Vec::new()),
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

fn bucket(time: &[f64], lo: &[f64], hi: &[f64]) -> Option<Sample> {
    let mut found: Option<Sample> = None;
    for ((&t, &lo), &hi) in time.iter().zip(lo).zip(hi) {
        if !(t.is_finite() && lo.is_finite() && hi.is_finite()) {
            continue;
        }
        found = Some(match found {
            None => Sample { t, lo, hi },
            Some(s) => Sample { t: s.t, lo: s.lo.min(lo), hi: s.hi.max(hi) },
        });
    }
    found
}

/// A part as a curve that touches both ends of every bucket's range.
pub(crate) fn curve(part: &[Sample]) -> Vec<(f64, f64)> {
    let mut points = Vec::with_capacity(2 * part.len());
    for (k, s) in part.iter().enumerate() {
        if s.hi <= s.lo {
            points.push((s.t, s.lo));
        } else if k % 2 == 0 {
            points.extend([(s.t, s.lo), (s.t, s.hi)]);
        } else {
            points.extend([(s.t, s.hi), (s.t, s.lo)]);
        }
    }
    points
}

/// A part as a band.
pub(crate) fn band(part: &[Sample]) -> Vec<(f64, f64, f64)> {
    part.iter().map(|s| (s.t, s.lo, s.hi)).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]
    use super::*;

    #[test]
    fn a_long_series_keeps_its_extremes() {
        let time: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut value = vec![0.0; 100_000];
        value[54_321] = 7.0;
        value[12_345] = -3.0;
        let parts = parts(&time, &value, &value);
        assert!(parts[0].len() <= BUCKETS);
        assert_eq!(parts[0].iter().map(|s| s.hi).fold(0.0, f64::max), 7.0);
        assert_eq!(parts[0].iter().map(|s| s.lo).fold(0.0, f64::min), -3.0);
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
}
