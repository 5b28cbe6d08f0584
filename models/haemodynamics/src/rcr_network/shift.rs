//! Signals that follow their input by a shift in time, and the times at which they bend.
//!
//! A shifted signal is read from the record of its input at t − shift, so a negative shift reads ahead; beyond its ends the
//! record is constant. It is linear between the input's samples, but those times are known only to the record: a bend is
//! found where the lines through a span's two ends meet. Next file to read: [`super::super::rcr_network`].

use starlings_models_core::Drive;
use starlings_models_core::segment::{History, Segment};

/// Where a signal comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Source {
    /// Position among the model's inputs.
    pub(super) input: usize,
    /// Position of the shift in θ.
    pub(super) shift: Option<usize>,
}

/// Most halvings of a segment in the search for bends.
const DEPTH: u32 = 12;
/// Distance from an end, in parts of the span, over which the slope there is taken.
const NEAR: f64 = 1e-3;
/// Deviation from a line, in parts of the signal's size, that counts as none.
const STRAIGHT: f64 = 1e-11;

/// Writes the signals' values and slopes at time `t`. Slopes of shifted signals are not needed and left at zero.
pub(super) fn read(
    sources: &[Source],
    t: f64,
    theta: &[f64],
    u: Drive<'_>,
    values: &mut [f64],
    slopes: &mut [f64],
) {
    for ((source, value), slope) in sources.iter().zip(values).zip(slopes) {
        (*value, *slope) = match source.shift {
            None => (u.value[source.input], u.slope[source.input]),
            Some(at) => (u.history.at(source.input, t - theta[at]), 0.0),
        };
    }
}

/// Times from a segment's start to its end, between which every signal is linear.
pub(super) fn bends(sources: &[Source], segment: Segment<'_>, theta: &[f64]) -> Vec<f64> {
    let mut times = vec![segment.t0, segment.t1];
    for source in sources {
        if let Some(at) = source.shift {
            let signal = Shifted { history: segment.history, input: source.input, shift: theta[at] };
            signal.bends([segment.t0, segment.t1], DEPTH, &mut times);
        }
    }
    times.sort_by(f64::total_cmp);
    let least = 1e-9 * (segment.t1 - segment.t0);
    let mut kept: Vec<f64> = Vec::with_capacity(times.len());
    for time in times {
        if kept.last().is_none_or(|last| time - last > least) {
            kept.push(time);
        }
    }
    if let Some(last) = kept.last_mut() {
        *last = segment.t1;
    }
    kept
}

struct Shifted<'a> {
    history: &'a dyn History,
    input: usize,
    shift: f64,
}

impl Shifted<'_> {
    fn at(&self, t: f64) -> f64 {
        self.history.at(self.input, t - self.shift)
    }

    /// Adds the bends within a span.
    fn bends(&self, [a, b]: [f64; 2], depth: u32, times: &mut Vec<f64>) {
        let (length, first, last) = (b - a, self.at(a), self.at(b));
        let inner = [0.25, 0.618].map(|share| (share, self.at(a + share * length)));
        let size = inner.iter().map(|(_, v)| v.abs()).fold(first.abs().max(last.abs()), f64::max);
        // Times have a rounding error too.
        let clock = 8.0 * f64::EPSILON * (a.abs().max(b.abs()) + self.shift.abs());
        let slack = size * (STRAIGHT + clock / length);
        let bent = inner.iter().any(|(share, v)| (v - first - share * (last - first)).abs() > slack);
        if !bent || depth == 0 {
            return;
        }
        let near = NEAR * length;
        let [rise, fall] = [(self.at(a + near) - first) / near, (last - self.at(b - near)) / near];
        let meet = (last - first - fall * length) / (rise - fall);
        let found = meet > 0.0
            && meet < length
            && self.straight([a, a + meet], slack)
            && self.straight([a + meet, b], slack);
        if found {
            times.push(a + meet);
            return;
        }
        let middle = a + 0.5 * length;
        times.push(middle);
        self.bends([a, middle], depth - 1, times);
        self.bends([middle, b], depth - 1, times);
    }

    /// Whether the signal is a line, but for a slack.
    fn straight(&self, [a, b]: [f64; 2], slack: f64) -> bool {
        let (first, last) = (self.at(a), self.at(b));
        let off = |share: f64| self.at(a + share * (b - a)) - first - share * (last - first);
        [0.25, 0.618].into_iter().all(|share| off(share).abs() <= slack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starlings_models_core::Signal;
    use starlings_models_core::limits::Limits;

    struct Record(Signal);

    impl History for Record {
        fn at(&self, _index: usize, t: f64) -> f64 {
            self.0.at(t)
        }
    }

    fn found(shift: f64, [t0, t1]: [f64; 2]) -> Vec<f64> {
        let times: Vec<f64> = (0..40).map(|i| 0.02 * f64::from(i)).collect();
        let values = times.iter().map(|t| 400.0 * (7.0 * t).sin()).collect();
        let record = Record(Signal { times, values });
        let source = Source { input: 0, shift: Some(0) };
        let segment = Segment {
            t0,
            t1,
            u0: &[0.0],
            slope: &[0.0],
            history: &record,
            limits: &Limits::none(),
            noise: None,
        };
        bends(&[source], segment, &[shift])
    }

    #[test]
    fn the_bend_of_a_shifted_signal_is_found_within_a_sample_spacing() {
        for shift in [0.013, -0.007, 0.0331] {
            let times = found(shift, [0.2, 0.22]);
            let bend = 0.2 + (-(0.2 - shift) / 0.02_f64).rem_euclid(1.0) * 0.02;
            assert_eq!(times.len(), 3, "{shift}: {times:?}");
            // The place of a bend is as exact as slopes over a thousandth of the span.
            assert!((times[1] - bend).abs() < 1e-10, "{shift}: {times:?} and {bend}");
        }
        assert_eq!(found(0.02, [0.2, 0.22]).len(), 2);
    }

    #[test]
    fn a_span_over_several_samples_is_cut_until_it_is_straight() {
        let times = found(0.013, [0.2, 0.26]);
        for sample in [0.213, 0.233, 0.253] {
            assert!(times.iter().any(|t| (t - sample).abs() < 2e-5), "{sample} in {times:?}");
        }
    }
}
