//! Dormand–Prince as long as accuracy sets the step, Rosenbrock for the rest of a segment once stability does.
//!
//! Each segment is judged anew, so that a run depends on its job only. Next file to read: `control.rs`.

use super::Tolerance;
use super::dopri5::Dopri5;
use super::rosenbrock::Rosenbrock;
use super::span::{Reached, integrate};
use super::system::OnSegment;
use crate::segment::Segment;
use crate::{Model, ModelFailure};

/// Advances `x` over the segment within the tolerance.
///
/// # Errors
/// [`ModelFailure::TooManySteps`], [`ModelFailure::StepTooSmall`] or [`ModelFailure::NotFinite`], with the time reached.
pub fn advance<M: Model + ?Sized>(
    model: &M,
    segment: Segment<'_>,
    theta: &[f64],
    x: &mut [f64],
    tolerance: Tolerance,
) -> Result<(), ModelFailure> {
    let n = x.len();
    let mut system = OnSegment::new(model, segment, theta, n);
    let span = [segment.t0, segment.t1];
    if let Reached::Stiff(t) = integrate(&mut system, &mut Dopri5::new(n, true), span, x, tolerance)? {
        integrate(&mut system, &mut Rosenbrock::new(n), [t, segment.t1], x, tolerance)?;
    }
    Ok(())
}
