//! The system on a switching surface of another.
//!
//! The rate is the mean of the two sides' rates, weighted so that the state stays on the surface (Filippov 1988, §4); on a surface within
//! a surface the same mean of the rates there. Functions that vanish on the same surface, such as those of `sign(v)` in a model
//! and of `abs(v)` in an effect, are one surface: rounding would make their signs change at every step along it. Next file to read:
//! [`super::super::rosenbrock`].

use crate::integrate::Tolerance;
use crate::integrate::system::System;
use crate::limits::Limits;

/// Distance from the surface at which the two sides' rates are taken, and again twice as far, in tolerances: beyond rounding. The
/// rates at the surface are extrapolated from both, since a state may stay on it for as long as a run takes.
const OFFSET: f64 = 100.0;
/// Distance from the surface up to which the state is on it, in tolerances.
const NEAR: f64 = 10.0;
/// Growth, as a share of that of both sides, up to which a side does not lead away: one on which the state rests, but for rounding,
/// holds it as one that leads back does.
const AT_REST: f64 = 1e-9;
/// Sine of the largest angle between the normals of two functions of one surface: more than differences err, less than two
/// surfaces enclose that the state is held on.
const PARALLEL: f64 = 1e-3;

/// The system on a switching surface of another.
pub(super) struct Surface<'a> {
    inner: &'a mut dyn System,
    index: usize,
    /// Functions of the inner system that vanish on this surface too, `index` among them.
    same: Vec<bool>,
    tolerance: Tolerance,
    g: Vec<f64>,
    normal: Vec<f64>,
    moved: Vec<f64>,
    /// Distance from the surface at which the rates are taken.
    width: f64,
    /// From the state to the surface, in normals.
    foot: f64,
    /// From the state to the points at which they are taken, in normals.
    shifts: [f64; 2],
    /// Rates on the positive and the negative side, at the surface.
    rates: [Vec<f64>; 2],
    /// Rates twice as far from it.
    farther: Vec<f64>,
}

impl<'a> Surface<'a> {
    pub(super) fn new(inner: &'a mut dyn System, index: usize, tolerance: Tolerance) -> Self {
        let (n, m) = (inner.n_state(), inner.n_switch());
        let zeros = || vec![0.0; n];
        Self {
            index,
            same: (0..m).map(|i| i == index).collect(),
            tolerance,
            g: vec![0.0; m],
            normal: zeros(),
            moved: zeros(),
            width: 0.0,
            foot: 0.0,
            shifts: [0.0; 2],
            rates: [zeros(), zeros()],
            farther: zeros(),
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
        self.moved.copy_from_slice(x);
        let here = self.value(t);
        let h = step(t);
        let passing = (self.value(t + h) - here) / h;
        let mut share = f64::INFINITY;
        for (j, x) in x.iter().enumerate() {
            self.moved[j] = x + step(*x);
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
        (self.width, self.foot) = (share * square.sqrt(), -here / square);
        let mut growth = [passing; 2];
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            // From here to the surface, and from there to the side.
            self.shifts[side] = sign * share + self.foot;
            self.move_by(self.shifts[side], x);
            self.inner.rhs(t, &self.moved, &mut self.rates[side]);
            self.move_by(self.shifts[side] + sign * share, x);
            self.inner.rhs(t, &self.moved, &mut self.farther);
            for (rate, farther) in self.rates[side].iter_mut().zip(&self.farther) {
                *rate = if farther.is_finite() { 2.0 * *rate - farther } else { *rate };
            }
            growth[side] += self.normal.iter().zip(&self.rates[side]).map(|(a, b)| a * b).sum::<f64>();
        }
        Some(growth)
    }

    /// Goes to a point beside the state, so many normals away.
    fn move_by(&mut self, shift: f64, x: &[f64]) {
        for ((moved, x), normal) in self.moved.iter_mut().zip(x).zip(&self.normal) {
            *moved = x + shift * normal;
        }
    }

    /// Whether the state is on the surface, as far as the tolerance tells, and no side leads away from it.
    pub(super) fn holds(&mut self, t: f64, x: &[f64]) -> bool {
        let Some([up, down]) = self.growth(t, x) else { return false };
        let distance = self.foot.abs() * self.normal.iter().map(|v| v * v).sum::<f64>().sqrt();
        down > up
            && conditions([up, down]).iter().all(|c| *c >= 0.0)
            && OFFSET * distance <= NEAR * self.width
    }

    /// Moves a state that the surface holds onto it.
    pub(super) fn catch(&self, x: &mut [f64]) {
        for (x, normal) in x.iter_mut().zip(&self.normal) {
            *x += self.foot * normal;
        }
    }

    /// Finds the other functions that vanish on this surface: their signs differ on its two sides, and their gradients in time and
    /// state are parallel. To be called where the state is held.
    pub(super) fn join_others(&mut self, t: f64, x: &[f64]) {
        let (n, m) = (x.len(), self.g.len());
        let mut sides = [vec![0.0; m], vec![0.0; m]];
        for (side, values) in sides.iter_mut().enumerate() {
            self.move_by(self.shifts[side], x);
            self.inner.switches(t, &self.moved, values);
        }
        self.moved.copy_from_slice(x);
        let mut here = vec![0.0; m];
        self.inner.switches(t, x, &mut here);
        // One row per function: its slopes along the states and time.
        let mut slopes = vec![0.0; m * (n + 1)];
        for j in 0..=n {
            let (mut at, mut h) = (t, step(t));
            match x.get(j) {
                Some(x) => {
                    self.moved[j] = x + step(*x);
                    h = self.moved[j] - x;
                }
                None => at += h,
            }
            self.inner.switches(at, &self.moved, &mut self.g);
            for (i, (after, before)) in self.g.iter().zip(&here).enumerate() {
                slopes[i * (n + 1) + j] = (after - before) / h;
            }
            if let Some(x) = x.get(j) {
                self.moved[j] = *x;
            }
        }
        let of = |i: usize| &slopes[i * (n + 1)..(i + 1) * (n + 1)];
        let [up, down] = &sides;
        for (i, same) in self.same.iter_mut().enumerate().skip(self.inner.n_guard()) {
            *same |= up[i] * down[i] < 0.0 && is_parallel(of(i), of(self.index));
        }
    }
}

/// The conditions to stay, from the growth of the switching function on the positive and the negative side.
fn conditions([up, down]: [f64; 2]) -> [f64; 2] {
    let slack = AT_REST * (up.abs() + down.abs());
    [slack - up, slack + down]
}

/// Step of a difference (Dennis & Schnabel 1983, §5.4).
fn step(x: f64) -> f64 {
    f64::EPSILON.sqrt() * x.abs().max(1e-5)
}

/// Whether two directions are one, or opposite; a vanishing one is along any.
fn is_parallel(a: &[f64], b: &[f64]) -> bool {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let squares = dot(a, a) * dot(b, b);
    squares - dot(a, b).powi(2) <= PARALLEL * PARALLEL * squares
}

impl System for Surface<'_> {
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

    /// The two conditions to stay on the surface, those to stay on the surfaces around it, and the other surfaces.
    fn n_switch(&self) -> usize {
        2 + self.same.iter().filter(|same| !**same).count()
    }

    fn n_guard(&self) -> usize {
        2 + self.inner.n_guard()
    }

    fn switches(&mut self, t: f64, x: &[f64], g: &mut [f64]) {
        let growth = self.growth(t, x).unwrap_or([1.0, -1.0]);
        g[..2].copy_from_slice(&conditions(growth));
        self.inner.switches(t, x, &mut self.g);
        let others = self.g.iter().zip(&self.same).filter(|(_, same)| !**same).map(|(g, _)| *g);
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
