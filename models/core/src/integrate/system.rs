//! What an integrator sees: a rate, switching functions and a Jacobian, at a time and a state.
//!
//! Whoever has a system of its own, such as a model with its parameters and inputs, makes it one of these. Next file to read: [`super::control`].

use crate::failure::ModelFailure;
use crate::limits::Limits;

/// A system of ordinary differential equations.
pub(crate) trait System {
    fn n_state(&self) -> usize;
    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]);
    fn n_switch(&self) -> usize;
    fn switches(&mut self, t: f64, x: &[f64], g: &mut [f64]);

    /// How many of the first switching functions are conditions: an integration ends where one of them falls below zero.
    fn n_guard(&self) -> usize {
        0
    }

    /// Writes ∂f/∂x column by column and ∂f/∂t; `f` is the rate at (t, x), `scratch` holds 2n numbers.
    fn jacobian(
        &mut self,
        t: f64,
        x: &[f64],
        f: &[f64],
        dfdx: &mut [f64],
        dfdt: &mut [f64],
        scratch: &mut [f64],
    ) {
        differences(self, t, x, f, dfdx, dfdt, scratch);
    }

    /// Sources of white noise; only the methods for noise ask.
    fn n_noise(&self) -> usize {
        0
    }

    /// Writes the amplitudes of the noise, source by source.
    fn noise(&mut self, t: f64, x: &[f64], b: &mut [f64]) {
        let _ = (t, x, b);
    }

    /// Draws a standard normal number for each source.
    fn draw(&mut self, normal: &mut [f64]) {
        let _ = normal;
    }

    /// What the run may cost.
    fn limits(&self) -> &Limits<'_>;

    /// What one state component is called in an error.
    fn name(&self, component: usize) -> String;
}

/// One-sided differences with the step of Dennis & Schnabel (1983, §5.4).
pub(crate) fn differences<S: System + ?Sized>(
    system: &mut S,
    t: f64,
    x: &[f64],
    f: &[f64],
    dfdx: &mut [f64],
    dfdt: &mut [f64],
    scratch: &mut [f64],
) {
    let n = x.len();
    let (moved, shifted) = scratch.split_at_mut(n);
    let root = f64::EPSILON.sqrt();
    moved.copy_from_slice(x);
    for (j, column) in dfdx.chunks_exact_mut(n).enumerate() {
        let h = root * x[j].abs().max(1e-5);
        moved[j] = x[j] + h;
        system.rhs(t, moved, shifted);
        if !shifted.iter().all(|v| v.is_finite()) {
            // The state stands at the edge of where the rate is defined: look back.
            moved[j] = x[j] - h;
            system.rhs(t, moved, shifted);
        }
        for (d, (after, before)) in column.iter_mut().zip(shifted.iter().zip(f)) {
            *d = (after - before) / (moved[j] - x[j]);
        }
        moved[j] = x[j];
    }
    let h = root * t.abs().max(1e-5);
    system.rhs(t + h, x, shifted);
    for (d, (after, before)) in dfdt.iter_mut().zip(shifted.iter().zip(f)) {
        *d = (after - before) / h;
    }
}

/// The first component that is not finite, as an error.
pub(super) fn not_finite<S: System + ?Sized>(system: &S, t: f64, values: &[f64]) -> ModelFailure {
    let component = values.iter().position(|v| !v.is_finite()).unwrap_or(0);
    ModelFailure::NotFinite { what: system.name(component), time: t }
}
