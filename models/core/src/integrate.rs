//! Numerical integration of a system of ordinary differential equations over one span.
//!
//! One file per method: [`dopri5`] for smooth problems, [`rosenbrock`] for stiff ones, [`fixed`] for a step that never
//! adapts, [`stochastic`] for equations with noise. The step control, the location of switching points and sliding along them are shared by the adaptive methods.
//! Nothing here knows a model or keeps memory between spans, so that a run depends on its job only. Next file to read: [`dopri5`].

mod auto;
mod control;
mod dopri5;
mod events;
mod fixed;
pub mod rodas;
mod rosenbrock;
mod sliding;
mod span;
mod stepper;
mod stochastic;
mod system;

use dopri5::Dopri5;
use rosenbrock::Rosenbrock;
use stochastic::Sense;

use crate::failure::ModelFailure;

pub(crate) use system::{System, differences};

/// How exact a step must be: its error estimate stays below `absolute + relative · |x|` in the root mean square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Relative tolerance.
    pub relative: f64,
    /// Absolute tolerance, in each state's unit.
    pub absolute: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { relative: 1e-8, absolute: 1e-10 }
    }
}

/// Which method integrates a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solver {
    /// Dormand–Prince, going over to Rosenbrock for the rest of a segment that turns out stiff.
    Auto(Tolerance),
    /// Dormand–Prince 5(4).
    Dopri5(Tolerance),
    /// Rosenbrock 4(3).
    Rosenbrock(Tolerance),
    /// Classic Runge–Kutta in equal steps no longer than `step`.
    Fixed {
        /// Longest step, in the study's time unit.
        step: f64,
    },
    /// Heun's method in equal steps no longer than `step`: noise in the sense of Stratonovich.
    Heun {
        /// Longest step, in the study's time unit.
        step: f64,
    },
    /// The method of Euler and Maruyama in equal steps no longer than `step`: noise in the sense of Itô.
    EulerMaruyama {
        /// Longest step, in the study's time unit.
        step: f64,
    },
}

impl Default for Solver {
    fn default() -> Self {
        Self::Auto(Tolerance::default())
    }
}

/// Advances `x` over a span by the chosen method.
///
/// # Errors
/// [`ModelFailure::TooManySteps`], [`ModelFailure::StepTooSmall`] or [`ModelFailure::NotFinite`], with the time reached.
pub(crate) fn advance<S: System>(
    system: &mut S,
    solver: Solver,
    span: [f64; 2],
    x: &mut [f64],
) -> Result<(), ModelFailure> {
    let n = x.len();
    match solver {
        Solver::Auto(tolerance) => auto::advance(system, span, x, tolerance),
        Solver::Dopri5(tolerance) => {
            span::integrate(system, &mut Dopri5::new(n, false), span, x, tolerance).map(|_| ())
        }
        Solver::Rosenbrock(tolerance) => {
            span::integrate(system, &mut Rosenbrock::new(n), span, x, tolerance).map(|_| ())
        }
        Solver::Fixed { step } => fixed::advance(system, span, x, step),
        Solver::Heun { step } => stochastic::advance(system, span, x, step, Sense::Stratonovich),
        Solver::EulerMaruyama { step } => stochastic::advance(system, span, x, step, Sense::Ito),
    }
}
