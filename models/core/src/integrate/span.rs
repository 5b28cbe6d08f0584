//! A whole span by a method of adaptive steps: restarts at switching points, sliding along them, giving up for stiffness.
//!
//! Next file to read: `control.rs`, which makes one step.

use super::Tolerance;
use super::control::{Run, Step};
use super::sliding::slide;
use super::stepper::Stepper;
use super::system::System;
use crate::failure::ModelFailure;

/// How an integration ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reached {
    /// At the end of the span.
    End,
    /// At this time the method gave up for stiffness.
    Stiff(f64),
}

/// Integrates over a span, restarting at switching points and sliding along them where both sides lead back.
pub(super) fn integrate<S: System, P: Stepper>(
    system: &mut S,
    stepper: &mut P,
    span: [f64; 2],
    x: &mut [f64],
    tolerance: Tolerance,
) -> Result<Reached, ModelFailure> {
    if x.is_empty() {
        return Ok(Reached::End);
    }
    let mut run = Run::new(system, stepper, span, x, tolerance);
    run.start()?;
    while run.t < run.end {
        match run.step()? {
            Step::Stiff => return Ok(Reached::Stiff(run.t)),
            Step::Crossed => {
                let index = run.events.tracked();
                slide(&mut run, index..index + 1)?;
            }
            // A span may start where the one before it left the state sliding.
            Step::Refused if run.fresh => {
                let all = 0..run.system.n_switch();
                slide(&mut run, all)?;
            }
            Step::Passed | Step::Refused => {}
        }
    }
    Ok(Reached::End)
}
