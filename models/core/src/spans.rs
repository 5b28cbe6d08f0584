//! How long ago each output row was observed before: what an observer's correction is as strong as.
//!
//! A window says when the rows had their last values before it; within it the values themselves do. Next file to read:
//! [`crate::observer`].

use crate::Window;

/// Times of the last observed values, and the times since then.
pub(crate) struct Spans {
    last: Vec<f64>,
    spans: Vec<f64>,
}

impl Spans {
    /// At the start of a window with `n` rows.
    pub(crate) fn new(window: &Window, n: usize) -> Self {
        let last = if window.since.is_empty() { vec![window.start; n] } else { window.since.clone() };
        Self { last, spans: vec![0.0; n] }
    }

    /// Per row the time from its last value to `t`.
    pub(crate) fn until(&mut self, t: f64) -> &[f64] {
        for (span, last) in self.spans.iter_mut().zip(&self.last) {
            *span = t - last;
        }
        &self.spans
    }

    /// Notes the values of one time, NaN where there is none.
    pub(crate) fn see(&mut self, t: f64, observed: &[f64]) {
        for (last, value) in self.last.iter_mut().zip(observed) {
            if !value.is_nan() {
                *last = t;
            }
        }
    }
}
