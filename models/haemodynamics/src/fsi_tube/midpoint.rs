//! The implicit midpoint rule for the tube (Hairer, Lubich & Wanner 2006, section II.1.1), in O(N) operations per step.
//!
//! The unknowns of a step are the mean flows through the faces; wall and Windkessel are eliminated, and what remains is a
//! [`Chain`]. The rule is stable for any step and conserves what flows in, out and into the wall to rounding. Next file to
//! read: [`super::chain`].

use starlings_models_core::ModelFailure;
use starlings_models_core::segment::Segment;

use super::FsiTube;
use super::chain::Chain;
use super::coefficients::Coefficients;
use super::state::State;

/// Work arrays of one call, an entry per cell each.
struct Scratch<'a> {
    /// Stiffness k of wall and tissue.
    stiffness: &'a mut [f64],
    /// Pressure per mean flow into a cell, A/s.
    wall: &'a mut [f64],
    /// Right-hand side, then the mean flow out of each cell.
    flow: &'a mut [f64],
}

/// What does not change between steps of one length.
struct Step {
    dt: f64,
    /// Pressure per wall velocity by its inertia, 2m/dt.
    inertia: f64,
    /// Pressure per flow by the inertia of the fluid in a cell, 2 l dx/dt.
    inertance: f64,
    /// 1/(1 + dt/(2 R_d C)).
    relaxed: f64,
    /// Pressure of the Windkessel per mean flow into it.
    filling: f64,
    /// Pressure in a wall of the image's radius.
    image_pressure: f64,
}

impl FsiTube {
    /// Advances the state by `n` steps that fill a segment.
    ///
    /// # Errors
    /// When the run has reached its limits.
    pub(super) fn midpoint(
        &self,
        theta: &[f64],
        segment: Segment<'_>,
        n: usize,
        x: State<'_>,
    ) -> Result<(), ModelFailure> {
        let (h, q, slope) = (segment.t1 - segment.t0, segment.u0[0], segment.slope[0]);
        let c = self.coefficients(theta);
        let cells = self.n_cell();
        let mut work = vec![0.0; 5 * cells];
        let (stiffness, rest) = work.split_at_mut(cells);
        let (wall, rest) = rest.split_at_mut(cells);
        let (flow, rest) = rest.split_at_mut(cells);
        let (inverse, ratio) = rest.split_at_mut(cells);
        let step = Step::new(&c, h / n as f64, self.image_pressure);
        self.stiffness(theta, &c, stiffness);
        let viscous = step.inertia + c.damping;
        for (z, k) in wall.iter_mut().zip(&*stiffness) {
            *z = (viscous + 0.5 * step.dt * k) * c.per_area;
        }
        let face = step.inertance + c.friction;
        let chain = Chain::factor(face, wall, c.proximal + step.filling, inverse, ratio);
        let mut scratch = Scratch { stiffness, wall, flow };
        let State { eta, w, pi } = x;
        for i in 0..n {
            segment.limits.take(1, segment.t0 + step.dt * i as f64)?;
            let start = q + slope * step.dt * i as f64;
            let x = State { eta: &mut *eta, w: &mut *w, pi: &mut *pi };
            step.advance(&c, &chain, [start, start + slope * step.dt], &mut scratch, x);
        }
        Ok(())
    }
}

impl Step {
    fn new(c: &Coefficients, dt: f64, image_pressure: f64) -> Self {
        let relaxed = 1.0 / (1.0 + 0.5 * dt / (c.distal * c.compliance));
        Self {
            dt,
            inertia: 2.0 * c.mass / dt,
            inertance: 2.0 * c.inertance / dt,
            relaxed,
            filling: 0.5 * dt / c.compliance * relaxed,
            image_pressure,
        }
    }

    /// One step, the inflow going from `q[0]` to `q[1]`.
    fn advance(&self, c: &Coefficients, chain: &Chain<'_>, q: [f64; 2], by: &mut Scratch<'_>, x: State<'_>) {
        let State { eta, w, pi } = x;
        let inflow = 0.5 * (q[0] + q[1]);
        self.load(c, q[0], by, eta, w);
        let last = by.flow.len() - 1;
        // The last face is half as long: half the inertia of the others, and no cell behind it.
        by.flow[0] += by.wall[0] * inflow;
        // Between cells the image's pressure cancels; the Windkessel counts from zero.
        by.flow[last] += self.image_pressure - *pi * self.relaxed;
        chain.solve(by.flow);
        let mut above = inflow;
        for ((eta, w), &below) in eta.iter_mut().zip(w).zip(&*by.flow) {
            let mean = (above - below) * c.per_area;
            *eta += self.dt * mean;
            *w = 2.0 * mean - *w;
            above = below;
        }
        let mean = *pi * self.relaxed + self.filling * above;
        *pi = 2.0 * mean - *pi;
    }

    /// The right-hand side but for inlet and outlet: the fluid's momentum, and the wall's pressure behind and ahead of a face.
    fn load(&self, c: &Coefficients, inflow: f64, by: &mut Scratch<'_>, eta: &[f64], w: &[f64]) {
        let pressure = |k: usize| by.stiffness[k] * eta[k] - self.inertia * w[k];
        let last = eta.len() - 1;
        let mut flow = inflow;
        let mut behind = pressure(0);
        for (k, w) in w[..last].iter().enumerate() {
            flow -= c.area * w;
            let ahead = pressure(k + 1);
            by.flow[k] = self.inertance * flow + behind - ahead;
            behind = ahead;
        }
        flow -= c.area * w[last];
        by.flow[last] = 0.5 * self.inertance * flow + behind;
    }
}
