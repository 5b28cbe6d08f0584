//! Motion along a switching surface from which neither side leads away, such as a body held by dry friction.
//!
//! The rate is the mean of the two sides' rates, weighted so that the state stays on the surface (Filippov 1988, §4).
//! One surface at a time. Next file to read: [`super::rosenbrock`].

use std::ops::Range;

use super::Tolerance;
use super::control::Run;
use super::dopri5::Dopri5;
use super::stepper::Stepper;
use super::system::System;
use crate::failure::ModelFailure;
use crate::limits::Limits;

/// Distance from the surface at which the two sides' rates are taken, in tolerances: beyond rounding, below notice.
const OFFSET: f64 = 100.0;

/// Goes on along the first of the surfaces on which the state is held, until one side leads away or the span ends; does
/// nothing where it is held on none.
pub(super) fn slide<S: System, P: Stepper>(
    run: &mut Run<'_, S, P>,
    candidates: Range<usize>,
) -> Result<(), ModelFailure> {
    run.fresh = false;
    for index in candidates {
        let mut surface = Surface::new(run.system, index, run.tolerance);
        if run.t < run.end && surface.holds(run.t, run.x) {
            let mut stepper = Dopri5::new(run.x.len(), false);
            let mut along = Run::new(&mut surface, &mut stepper, [run.t, run.end], run.x, run.tolerance);
            along.steps = run.steps;
            along.start()?;
            while along.t < along.end && along.events.side(0) && along.events.side(1) {
                along.step()?;
            }
            (run.t, run.steps) = (along.t, along.steps);
            run.start()?;
            run.fresh = false;
            return Ok(());
        }
    }
    Ok(())
}

/// The system on a switching surface of another.
struct Surface<'a, S> {
    inner: &'a mut S,
    index: usize,
    tolerance: Tolerance,
    g: Vec<f64>,
    normal: Vec<f64>,
    moved: Vec<f64>,
    /// Distance from the surface at which the rates are taken.
    width: f64,
    /// Rates on the positive and the negative side.
    rates: [Vec<f64>; 2],
}

impl<'a, S: System> Surface<'a, S> {
    fn new(inner: &'a mut S, index: usize, tolerance: Tolerance) -> Self {
        let (n, m) = (inner.n_state(), inner.n_switch());
        let zeros = || vec![0.0; n];
        Self {
            index,
            tolerance,
            g: vec![0.0; m],
            normal: zeros(),
            moved: zeros(),
            width: 0.0,
            rates: [zeros(), zeros()],
            inner,
        }
    }

    fn value(&mut self, t: f64) -> f64 {
        self.inner.switches(t, &self.moved, &mut self.g);
        self.g[self.index]
    }

    /// How fast the switching function grows by the rates of the positive and the negative side; the rates are left in
    /// `self.rates`. `None` where the function does not depend on the state.
    fn growth(&mut self, t: f64, x: &[f64]) -> Option<[f64; 2]> {
        let root = f64::EPSILON.sqrt();
        self.moved.copy_from_slice(x);
        let here = self.value(t);
        let h = root * t.abs().max(1e-5);
        let passing = (self.value(t + h) - here) / h;
        let mut share = f64::INFINITY;
        for (j, x) in x.iter().enumerate() {
            let h = root * x.abs().max(1e-5);
            self.moved[j] = x + h;
            self.normal[j] = (self.value(t) - here) / (self.moved[j] - x);
            self.moved[j] = *x;
            if self.normal[j].abs() > 0.0 {
                let unit = self.tolerance.absolute + self.tolerance.relative * x.abs();
                share = share.min(OFFSET * unit / self.normal[j].abs());
            }
        }
        let square: f64 = self.normal.iter().map(|v| v * v).sum();
        if !share.is_finite() || square <= 0.0 {
            return None;
        }
        self.width = share * square.sqrt();
        let mut growth = [passing; 2];
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            // From here to the surface, and from there to the side.
            let shift = sign * share - here / square;
            for ((m, x), normal) in self.moved.iter_mut().zip(x).zip(&self.normal) {
                *m = x + shift * normal;
            }
            self.inner.rhs(t, &self.moved, &mut self.rates[side]);
            growth[side] += self.normal.iter().zip(&self.rates[side]).map(|(a, b)| a * b).sum::<f64>();
        }
        Some(growth)
    }

    /// Whether the state is on the surface, as far as the tolerance tells, and both sides lead back to it.
    fn holds(&mut self, t: f64, x: &[f64]) -> bool {
        let Some([up, down]) = self.growth(t, x) else { return false };
        let shift = self.moved.iter().zip(x).map(|(m, x)| (m - x).powi(2)).sum::<f64>().sqrt();
        up < 0.0 && down > 0.0 && shift <= 2.0 * self.width
    }
}

impl<S: System> System for Surface<'_, S> {
    fn n_state(&self) -> usize {
        self.inner.n_state()
    }

    fn rhs(&mut self, t: f64, x: &[f64], dx: &mut [f64]) {
        let weight = match self.growth(t, x) {
            Some([up, down]) if down - up > 0.0 => (down / (down - up)).clamp(0.0, 1.0),
            _ => 0.5,
        };
        for (dx, (plus, minus)) in dx.iter_mut().zip(self.rates[0].iter().zip(&self.rates[1])) {
            *dx = weight * plus + (1.0 - weight) * minus;
        }
    }

    /// The two conditions to stay on the surface, and the other surfaces.
    fn n_switch(&self) -> usize {
        self.inner.n_switch() + 1
    }

    fn switches(&mut self, t: f64, x: &[f64], g: &mut [f64]) {
        let [up, down] = self.growth(t, x).unwrap_or([1.0, -1.0]);
        (g[0], g[1]) = (-up, down);
        self.inner.switches(t, x, &mut self.g);
        let others = self.g.iter().enumerate().filter(|(i, _)| *i != self.index).map(|(_, g)| *g);
        for (g, other) in g[2..].iter_mut().zip(others) {
            *g = other;
        }
    }

    fn limits(&self) -> &Limits<'_> {
        self.inner.limits()
    }

    fn name(&self, component: usize) -> String {
        self.inner.name(component)
    }
}
