//! Dormand–Prince as long as accuracy sets the step, Rosenbrock for the rest of a segment once stability does.
//!
//! Each span is judged anew, so that a run depends on its job only. Next file to read: `control.rs`.

use super::Tolerance;
use super::dopri5::Dopri5;
use super::rosenbrock::Rosenbrock;
use super::span::{Reached, integrate};
use super::system::System;
use crate::failure::ModelFailure;

/// Advances `x` over the span within the tolerance.
///
/// # Errors
/// [`ModelFailure::TooManySteps`], [`ModelFailure::StepTooSmall`] or [`ModelFailure::NotFinite`], with the time reached.
pub(super) fn advance<S: System>(
    system: &mut S,
    [start, end]: [f64; 2],
    x: &mut [f64],
    tolerance: Tolerance,
) -> Result<(), ModelFailure> {
    let n = x.len();
    if let Reached::Stiff(t) = integrate(system, &mut Dopri5::new(n, true), [start, end], x, tolerance)? {
        integrate(system, &mut Rosenbrock::new(n), [t, end], x, tolerance)?;
    }
    Ok(())
}
