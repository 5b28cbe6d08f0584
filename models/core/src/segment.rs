//! What drives a model: its inputs at one time, over a span on which they are linear, and at earlier times.
//!
//! Next file to read: [`crate::model`].

use crate::ModelFailure;
use crate::limits::Limits;
use crate::noise::WhiteNoise;

/// Access to input signals, and to what the model remembers of itself, at other times than now.
pub trait History {
    /// Value of input `index` at time `t`; before the first sample, the first sample's value. Indices beyond the inputs are
    /// the model's memories; NaN for a time that they do not reach.
    fn at(&self, index: usize, t: f64) -> f64;
}

/// The inputs of a model at one time.
#[derive(Clone, Copy)]
pub struct Drive<'a> {
    /// Values, in the order of [`crate::Spec::inputs`].
    pub value: &'a [f64],
    /// Time derivatives of the inputs on the current segment.
    pub slope: &'a [f64],
    /// The inputs at earlier times.
    pub history: &'a dyn History,
}

impl Drive<'_> {
    /// No inputs, for what may not use any.
    pub const NONE: Drive<'static> = Drive { value: &[], slope: &[], history: &NoInputs };
}

/// The past of no inputs: nothing that may ask for it has any.
struct NoInputs;

impl History for NoInputs {
    fn at(&self, _index: usize, _t: f64) -> f64 {
        f64::NAN
    }
}

/// A span of time on which every input is linear.
#[derive(Clone, Copy)]
pub struct Segment<'a> {
    /// Start time.
    pub t0: f64,
    /// End time, `t1 > t0`.
    pub t1: f64,
    /// Input values at `t0`.
    pub u0: &'a [f64],
    /// Input slopes on the segment.
    pub slope: &'a [f64],
    /// The inputs at earlier times.
    pub history: &'a dyn History,
    /// What the run may cost; a step that takes time counts itself.
    pub limits: &'a Limits<'a>,
    /// Where the numbers of the model's noise come from; `None` leaves the noise out.
    pub noise: Option<&'a WhiteNoise>,
}

impl Segment<'_> {
    /// Where a step from `t` ends that is at most `longest` long: one of equal steps up to the segment's end, as far as the state does
    /// not change the longest one. The step is counted.
    ///
    /// # Errors
    /// When the step does not move the time, or the run costs more than its limits allow.
    pub fn next_time(&self, t: f64, longest: f64) -> Result<f64, ModelFailure> {
        let left = self.t1 - t;
        let dt = left / (left / longest).ceil().max(1.0);
        let next = if dt < left { t + dt } else { self.t1 };
        if next <= t {
            return Err(ModelFailure::StepTooSmall { time: t, step: dt });
        }
        self.limits.foresee(longest, t)?;
        self.limits.take(1, t)?;
        Ok(next)
    }
}
