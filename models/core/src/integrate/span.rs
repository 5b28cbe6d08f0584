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
    /// At the end of the span, or where a condition to stay on a surface failed.
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
    follow(&mut run)
}

/// Goes on with a run that was started, up to its end or to where a condition of its system to stay on it fails.
pub(super) fn follow<S: System, P: Stepper>(run: &mut Run<'_, S, P>) -> Result<Reached, ModelFailure> {
    let guards = run.system.n_guard();
    while run.t < run.end && (0..guards).all(|guard| run.events.side(guard)) {
        match run.step()? {
            Step::Stiff => return Ok(Reached::Stiff(run.t)),
            Step::Crossed => {
                let index = run.events.tracked();
                if index >= guards {
                    slide(run, index..index + 1)?;
                }
            }
            // A span may start where the one before it left the state sliding.
            Step::Refused if run.fresh => {
                let all = guards..run.system.n_switch();
                slide(run, all)?;
            }
            // Beyond a surface ahead the rates lead back, so that no step ends there.
            Step::Refused if run.faces_switch() => {
                let index = run.events.tracked();
                if index >= guards {
                    slide(run, index..index + 1)?;
                }
            }
            Step::Passed | Step::Refused => {}
        }
    }
    Ok(Reached::End)
}
