//! A model on one segment as the system of differential equations that an integrator sees.
//!
//! Parameters and inputs are bound here and appear no further. Next file to read: [`crate::integrate`].

use super::Model;
use crate::failure::ModelFailure;
use crate::integrate::{self, Solver, System, differences};
use crate::limits::Limits;
use crate::scratch::Scratch;
use crate::segment::{Drive, Segment};
use crate::spec::Spec;

/// Advances `x` over the segment by integrating [`Model::rhs`].
///
/// # Errors
/// [`ModelFailure::TooManySteps`], [`ModelFailure::StepTooSmall`] or [`ModelFailure::NotFinite`], with the time reached.
pub fn advance_by<M: Model + ?Sized>(
    model: &M,
    solver: Solver,
    segment: Segment<'_>,
    theta: &[f64],
    x: &mut [f64],
) -> Result<(), ModelFailure> {
    let mut system = OnSegment::new(model, segment, theta, x.len());
    integrate::advance(&mut system, solver, [segment.t0, segment.t1], x)
}

/// A model on one segment.
struct OnSegment<'a, M: ?Sized> {
    model: &'a M,
    segment: Segment<'a>,
    theta: &'a [f64],
    u: Scratch,
    n_state: usize,
    n_switch: usize,
}

impl<'a, M: Model + ?Sized> OnSegment<'a, M> {
    fn new(model: &'a M, segment: Segment<'a>, theta: &'a [f64], n_state: usize) -> Self {
        Self { model, segment, theta, u: Scratch::of(segment.u0), n_state, n_switch: model.n_switch() }
    }

    #[inline]
    fn set_time(&mut self, t: f64) {
        let past = t - self.segment.t0;
        for ((u, u0), slope) in self.u.as_mut().iter_mut().zip(self.segment.u0).zip(self.segment.slope) {
            *u = u0 + slope * past;
        }
    }

    #[inline]
    fn drive(&self) -> Drive<'_> {
        Drive { value: self.u.as_ref(), slope: self.segment.slope, history: self.segment.history }
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

    fn n_noise(&self) -> usize {
        if self.segment.noise.is_some() { self.model.n_noise() } else { 0 }
    }

    fn noise(&mut self, t: f64, x: &[f64], b: &mut [f64]) {
        self.set_time(t);
        self.model.noise(t, x, self.theta, self.drive(), b);
    }

    fn draw(&mut self, normal: &mut [f64]) {
        if let Some(noise) = self.segment.noise {
            noise.draw(normal);
        }
    }

    fn limits(&self) -> &Limits<'_> {
        self.segment.limits
    }

    fn name(&self, component: usize) -> String {
        format!("state `{}`", Spec::component(&self.model.spec().states, component))
    }
}
