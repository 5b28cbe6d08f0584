//! What an integrator sees: a rate, switching functions and a Jacobian, at a time and a state.
//!
//! Parameters and inputs are bound here and appear no further. Next file to read: [`super::control`].

use crate::limits::Limits;
use crate::segment::{Drive, Segment};
use crate::{Model, ModelFailure, Spec};

/// A system of ordinary differential equations.
pub(super) trait System {
    fn n_state(&self) -> usize;
    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]);
    fn n_switch(&self) -> usize;
    fn switches(&mut self, t: f64, x: &[f64], g: &mut [f64]);

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

    /// What the run may cost.
    fn limits(&self) -> &Limits<'_>;

    /// What one state component is called in an error.
    fn name(&self, component: usize) -> String;
}

/// One-sided differences with the step of Dennis & Schnabel (1983, §5.4).
pub(super) fn differences<S: System + ?Sized>(
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

/// A model on one segment.
pub(super) struct OnSegment<'a, M: ?Sized> {
    model: &'a M,
    segment: Segment<'a>,
    theta: &'a [f64],
    u: Vec<f64>,
    n_state: usize,
    n_switch: usize,
}

impl<'a, M: Model + ?Sized> OnSegment<'a, M> {
    pub(super) fn new(model: &'a M, segment: Segment<'a>, theta: &'a [f64], n_state: usize) -> Self {
        Self { model, segment, theta, u: segment.u0.to_vec(), n_state, n_switch: model.n_switch() }
    }

    #[inline]
    fn set_time(&mut self, t: f64) {
        let past = t - self.segment.t0;
        for ((u, u0), slope) in self.u.iter_mut().zip(self.segment.u0).zip(self.segment.slope) {
            *u = u0 + slope * past;
        }
    }

    #[inline]
    fn drive(&self) -> Drive<'_> {
        Drive { value: &self.u, slope: self.segment.slope, history: self.segment.history }
    }
}

impl<M: Model + ?Sized> System for OnSegment<'_, M> {
    fn n_state(&self) -> usize {
        self.n_state
    }

    #[inline]
    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]) {
        self.set_time(t);
        self.model.rhs(t, x, self.theta, self.drive(), dx);
    }

    fn n_switch(&self) -> usize {
        self.n_switch
    }

    fn switches(&mut self, t: f64, x: &[f64], g: &mut [f64]) {
        self.set_time(t);
        self.model.switches(t, x, self.theta, self.drive(), g);
    }

    fn jacobian(
        &mut self,
        t: f64,
        x: &[f64],
        f: &[f64],
        dfdx: &mut [f64],
        dfdt: &mut [f64],
        scratch: &mut [f64],
    ) {
        self.set_time(t);
        if !self.model.jacobian(t, x, self.theta, self.drive(), dfdx, dfdt) {
            differences(self, t, x, f, dfdx, dfdt, scratch);
        }
    }

    fn limits(&self) -> &Limits<'_> {
        self.segment.limits
    }

    fn name(&self, component: usize) -> String {
        format!("state `{}`", Spec::component(&self.model.spec().states, component))
    }
}
