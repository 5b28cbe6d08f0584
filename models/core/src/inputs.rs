//! The inputs of a window as spans of time on which every signal is linear.
//!
//! Walks forward only; the walk costs no search and no allocation per step. Next file to read: [`crate::simulator`].

use crate::limits::Limits;
use crate::segment::{Drive, History, Segment};
use crate::{Signal, Window};

impl Signal {
    /// Value at time `t`: linear between samples, constant beyond them. NaN for an empty signal or a time that is NaN.
    pub fn at(&self, t: f64) -> f64 {
        if t.is_nan() {
            return t;
        }
        match self.times.partition_point(|&sample| sample <= t) {
            0 => self.values.first().copied().unwrap_or(f64::NAN),
            k if k == self.times.len() => self.values[k - 1],
            k => {
                let slope = self.slope(k);
                self.values[k - 1] + slope * (t - self.times[k - 1])
            }
        }
    }

    /// Slope between samples k − 1 and k.
    fn slope(&self, k: usize) -> f64 {
        (self.values[k] - self.values[k - 1]) / (self.times[k] - self.times[k - 1])
    }
}

impl History for Window {
    fn at(&self, index: usize, t: f64) -> f64 {
        self.inputs[index].at(t)
    }
}

/// Times closer than this are one time: a span of a rounding error is no span to integrate over.
fn rounding(t: f64) -> f64 {
    4.0 * f64::EPSILON * t.abs()
}

/// A walk along the inputs of one window.
pub(crate) struct Inputs<'a> {
    window: &'a Window,
    /// Per signal, how many samples lie at or before the current span's start.
    passed: Vec<usize>,
    value: Vec<f64>,
    slope: Vec<f64>,
}

impl<'a> Inputs<'a> {
    /// Starts at the window's start. The signals hold at least one sample each.
    pub(crate) fn new(window: &'a Window) -> Self {
        let n = window.inputs.len();
        let reached = window.start + rounding(window.start);
        let passed = window.inputs.iter().map(|s| s.times.partition_point(|&t| t <= reached)).collect();
        let mut walk = Self { window, passed, value: vec![0.0; n], slope: vec![0.0; n] };
        walk.enter(window.start);
        walk
    }

    /// Enters the span that starts at `t` and returns the time of the next sample of any signal.
    fn enter(&mut self, t: f64) -> f64 {
        let reached = t + rounding(t);
        let mut next = f64::INFINITY;
        for (i, signal) in self.window.inputs.iter().enumerate() {
            let mut k = self.passed[i];
            while signal.times.get(k).is_some_and(|&sample| sample <= reached) {
                k += 1;
            }
            self.passed[i] = k;
            if k == 0 || k == signal.times.len() {
                self.slope[i] = 0.0;
                self.value[i] = signal.values[k.saturating_sub(1)];
            } else {
                self.slope[i] = signal.slope(k);
                self.value[i] = signal.values[k - 1] + self.slope[i] * (t - signal.times[k - 1]);
            }
            if let Some(&sample) = signal.times.get(k) {
                next = next.min(sample);
            }
        }
        next
    }

    /// Calls `span` for each stretch of `(from, to]` on which all inputs are linear, in order, and stops at the first error; the
    /// stretches carry the limits of the run.
    pub(crate) fn walk<E>(
        &mut self,
        [from, to]: [f64; 2],
        limits: &Limits<'_>,
        mut span: impl FnMut(Segment<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut t0 = from;
        while t0 < to {
            let next = self.enter(t0);
            let t1 = if next + rounding(next) >= to { to } else { next };
            span(Segment {
                t0,
                t1,
                u0: &self.value,
                slope: &self.slope,
                history: self.window,
                limits,
                noise: None,
            })?;
            t0 = t1;
        }
        Ok(())
    }

    /// The inputs at the end `t` of the span last entered: its slopes, and sample values where `t` is a sample.
    pub(crate) fn drive(&mut self, t: f64) -> Drive<'_> {
        let reached = t + rounding(t);
        for (i, signal) in self.window.inputs.iter().enumerate() {
            let k = self.passed[i];
            if k == signal.times.len() {
                continue;
            }
            if signal.times[k] <= reached {
                self.value[i] = signal.values[k];
            } else if k > 0 {
                self.value[i] = signal.values[k - 1] + self.slope[i] * (t - signal.times[k - 1]);
            }
        }
        Drive { value: &self.value, slope: &self.slope, history: self.window }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp)]
    use super::*;

    fn window() -> Window {
        let flow = Signal { times: vec![0.0, 1.0, 3.0], values: vec![0.0, 10.0, 0.0] };
        let other = Signal { times: vec![0.5, 2.0], values: vec![1.0, 4.0] };
        Window::free(0.0, vec![4.0], 0, vec![flow, other])
    }

    #[test]
    fn spans_end_at_the_samples_of_every_signal() {
        let window = window();
        let mut ends = Vec::new();
        let mut inputs = Inputs::new(&window);
        let walked: Result<(), ()> = inputs.walk([0.0, 4.0], &Limits::none(), |s| {
            ends.push((s.t1, s.u0[0], s.slope[1]));
            Ok(())
        });
        assert_eq!(walked, Ok(()));
        let want = [(0.5, 0.0, 0.0), (1.0, 5.0, 2.0), (2.0, 10.0, 2.0), (3.0, 5.0, 0.0), (4.0, 0.0, 0.0)];
        assert_eq!(ends, want);
        assert_eq!(inputs.drive(4.0).value, [0.0, 4.0]);
    }

    #[test]
    fn a_signal_is_linear_between_samples_and_constant_beyond() {
        let signal = &window().inputs[0];
        assert_eq!([-1.0, 0.25, 1.0, 2.0, 9.0].map(|t| signal.at(t)), [0.0, 2.5, 10.0, 5.0, 0.0]);
        assert!(signal.at(f64::NAN).is_nan(), "an unknown time has no value");
    }

    #[test]
    fn a_sample_within_rounding_of_the_end_makes_no_span_of_its_own() {
        let mut window = window();
        window.inputs.truncate(1);
        window.inputs[0].times[1] = 0.3;
        let end = 0.1 + 0.2;
        let mut spans = 0;
        let mut inputs = Inputs::new(&window);
        let _: Result<(), ()> = inputs.walk([0.0, end], &Limits::none(), |_| {
            spans += 1;
            Ok(())
        });
        assert_eq!(spans, 1);
        assert_eq!(inputs.drive(end).value, [10.0]);
    }
}
