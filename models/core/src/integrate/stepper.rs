//! What a method with an error estimate is to the choice of its steps.
//!
//! Next file to read: `control.rs`.

use super::Tolerance;
use super::system::System;

/// Most steps, accepted or not, within one segment of a run without limits.
pub(super) const MAX_STEPS: u64 = 1_000_000;

/// A one-step method with an error estimate.
pub(super) trait Stepper {
    /// Order at which the error estimate falls with the step.
    const ORDER: f64;

    /// Prepares for a step from a point that no accepted step led to.
    fn restart<S: System>(&mut self, system: &mut S, t: f64, x: &[f64]);

    /// The rate at the current point.
    fn rate(&self) -> &[f64];

    /// Writes the state after a step of length `h` and returns the scaled norm of its error estimate.
    fn attempt<S: System>(
        &mut self,
        system: &mut S,
        t: f64,
        x: &[f64],
        h: f64,
        new: &mut [f64],
        tolerance: Tolerance,
    ) -> f64;

    /// Makes the last attempt, which ended at `(t, new)`, the current point; says whether to give up for stiffness.
    fn accept<S: System>(&mut self, system: &mut S, t: f64, h: f64, new: &[f64]) -> bool;
}

/// An error in units of the tolerance.
#[inline]
pub(super) fn scaled(error: f64, before: f64, after: f64, tolerance: Tolerance) -> f64 {
    error / (tolerance.absolute + tolerance.relative * before.abs().max(after.abs()))
}
