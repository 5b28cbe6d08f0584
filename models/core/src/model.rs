//! The forward model: a state, its rate, what it shows, where it starts.
//!
//! A model does not know windows, data or observers: [`crate::simulator`] does. Next file to read: [`crate::equations`]
//! for models written in a study; the built-in ones are crates beside this one.

mod on_segment;

use crate::blocks::Sections;
use crate::integrate::Solver;
use crate::memory::Memory;
use crate::segment::{Drive, Segment};
use crate::slopes::Slopes;
use crate::{Blocks, ModelFailure, Spec};

pub use on_segment::advance_by;

/// A dynamical system dx = f(t, x, θ, u) dt + b(t, x, θ, u) dW, y = h(t, x, θ, u).
///
/// Slices: `x` and `dx` have [`Spec::n_state`] entries, `theta` one per [`Spec::parameters`], `y` [`Spec::n_output`].
pub trait Model: Send + Sync {
    /// What the model says of itself.
    fn spec(&self) -> &Spec;

    /// Writes the initial state for these parameters.
    fn initial(&self, theta: &[f64], x: &mut [f64]);

    /// Writes the rate of the state.
    fn rhs(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]);

    /// Writes the outputs.
    fn output(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]);

    /// Which integrator the default [`Model::advance`] uses.
    fn solver(&self) -> Solver {
        Solver::default()
    }

    /// Number of sources of white noise in the rate. A run without a seed leaves them out.
    fn n_noise(&self) -> usize {
        0
    }

    /// Writes the amplitudes of the sources of noise, b (n × [`Model::n_noise`], source by source): dx = f dt + b dW.
    fn noise(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, b: &mut [f64]) {
        let _ = (t, x, theta, u, b);
    }

    /// Number of switching functions; a model that wraps another adds its own to the inner model's.
    fn n_switch(&self) -> usize {
        0
    }

    /// Writes the switching functions: the rate may jump or have a kink where one of them changes sign, and the integrators
    /// restart there.
    fn switches(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, g: &mut [f64]) {
        let _ = (t, x, theta, u, g);
    }

    /// Writes ∂f/∂x (n × n, column by column) and the rate's time derivative at fixed state, inputs moving by their slopes;
    /// says whether it did. Without it a stiff integrator takes finite differences.
    fn jacobian(
        &self,
        t: f64,
        x: &[f64],
        theta: &[f64],
        u: Drive<'_>,
        dfdx: &mut [f64],
        dfdt: &mut [f64],
    ) -> bool {
        let _ = (t, x, theta, u, dfdx, dfdt);
        false
    }

    /// The equations with their derivatives.
    ///
    /// # Errors
    /// Why the model has none, as the end of a sentence that names it.
    fn slopes(&self) -> Result<&dyn Slopes, String> {
        Err("it is built in, and only models of equations give their derivatives".to_owned())
    }

    /// The blocks of a linear fluid–structure system at these parameters; `None` for a model that is none. Whether there are
    /// any does not depend on the parameters' values, which may be placeholders.
    fn blocks(&self, theta: &[f64]) -> Option<Blocks> {
        let _ = theta;
        None
    }

    /// The sections of a network of vessels at these parameters; `None` for a model that is none. Whether there are any does not depend
    /// on the parameters' values, which may be placeholders.
    fn sections(&self, theta: &[f64]) -> Option<Sections> {
        let _ = theta;
        None
    }

    /// What the model remembers of itself. The past of memory i is input `n_input + i` of [`Drive::history`]; whoever runs
    /// the model keeps it.
    fn memories(&self) -> &[Memory] {
        &[]
    }

    /// Writes the present value of each of [`Model::memories`].
    fn remembered(&self, t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, values: &mut [f64]) {
        let _ = (t, x, theta, u, values);
    }

    /// Advances `x` over one segment. The default integrates [`Model::rhs`] as [`Model::solver`] says; a model with a
    /// closed-form or structure-preserving step overrides it.
    ///
    /// # Errors
    /// When the integrator cannot reach the segment's end.
    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        advance_by(self, self.solver(), segment, theta, x)
    }
}
