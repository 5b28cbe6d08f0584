//! Motion along switching surfaces from which neither side leads away, such as a body held by dry friction.
//!
//! A surface is a system of its own, so that on it the state may be held on a further one: two bodies at rest, each by its own friction.
//! What is on a surface leaves it when one of the conditions to stay, its own or that of a surface around it, fails. Next file to
//! read: [`surface`].

mod surface;

use std::ops::Range;

use super::Tolerance;
use super::control::Run;
use super::dopri5::Dopri5;
use super::rosenbrock::Rosenbrock;
use super::span::{Reached, follow};
use super::stepper::Stepper;
use super::system::System;
use crate::failure::ModelFailure;
use surface::Surface;

/// Goes on along the first of the surfaces on which the state is held, until one side leads away or the span ends; does
/// nothing where it is held on none.
pub(super) fn slide<S: System, P: Stepper>(
    run: &mut Run<'_, S, P>,
    candidates: Range<usize>,
) -> Result<(), ModelFailure> {
    run.fresh = false;
    for index in candidates {
        if run.t >= run.end {
            return Ok(());
        }
        let mut surface = Surface::new(&mut *run.system, index, run.tolerance);
        if surface.holds(run.t, run.x) {
            surface.catch(run.x);
            surface.join_others(run.t, run.x);
            (run.t, run.steps) = along(&mut surface, [run.t, run.end], run.x, run.tolerance, run.steps)?;
            run.start()?;
            run.fresh = false;
            return Ok(());
        }
    }
    Ok(())
}

/// Follows a surface from where `steps` steps were taken; the time at which the state leaves it, and the steps by then.
fn along(
    surface: &mut Surface<'_>,
    [t, end]: [f64; 2],
    x: &mut [f64],
    tolerance: Tolerance,
    steps: u64,
) -> Result<(f64, u64), ModelFailure> {
    let mut smooth = Dopri5::new(x.len(), true);
    let mut run = Run::new(surface, &mut smooth, [t, end], x, tolerance);
    run.steps = steps;
    run.start()?;
    let reached = follow(&mut run)?;
    let (t, steps) = (run.t, run.steps);
    let Reached::Stiff(_) = reached else { return Ok((t, steps)) };
    let mut stiff = Rosenbrock::new(x.len());
    let mut run = Run::new(surface, &mut stiff, [t, end], x, tolerance);
    run.steps = steps;
    run.start()?;
    follow(&mut run)?;
    Ok((run.t, run.steps))
}
