//! Blood in an elastic tube: the fluid–structure system of wave propagation in one artery, linear and cheap.
//!
//! The vessel is a row of rings that move independently of each other (no bending, no tension along the axis) and a flow
//! that is linear in the displacement; large displacements and vessels that branch are not here. Next file to read:
//! `fsi_tube/layout.rs`, then `fsi_tube/midpoint.rs`.

mod blocks;
mod chain;
mod coefficients;
pub mod layout;
mod midpoint;
mod quantities;
mod state;

use starlings_models_core::segment::Segment;
use starlings_models_core::{Blocks, Drive, Model, ModelDef, ModelFailure, SetupError, Spec};

use crate::MOST_STEPS;
use crate::prestress::Rings;
use chain::Chain;
use coefficients::Coefficients;
pub use layout::{Layout, Start};
use state::State;

/// A tube of N cells of length dx, radius R and section A₀ = πR², with displacement η and velocity w of the wall in each
/// cell, flow Q through each face, and an RCR Windkessel of pressure π behind the last face (Quarteroni, Tuveri & Veneziani
/// 2000; tissue support as in Moireau et al. 2012):
///
/// 2πR w + ∂Q/∂x = 0,  (ρ_f/A₀) dQ/dt + (8πμ/A₀²) Q + ∂p/∂x = 0,
///
/// ρ_s h dw/dt + (c_w + c_s) w + (E h/((1 − ν²)R²) + k_s) η = p,  dη/dt = w,
///
/// p = π + R_p Q at the outlet,  C dπ/dt = Q − π/R_d.
///
/// The wall's circumferential strain is ε = η/R and its stress σ = E ε/(1 − ν²) + c_w w R/h, that of a ring which is kept from moving
/// along the axis (Quarteroni, Tuveri & Veneziani 2000, the terms of the wall above times R/h).
///
/// Units are cm, g, s and dyn/cm². E is `E1`, `E2`, ... in the regions of the [`Layout`].
///
/// With an image pressure p_i in the layout, R is the radius seen in an image under p_i and η counts from the image: the
/// wall's R in E h/((1 − ν²)R²) becomes the unloaded radius R_u of each region, (E h/((1 − ν²)R_u²) + k_s)(R − R_u) = p_i,
/// and the wall carries p − p_i. The blood moves as in a tube of the image's radius.
pub struct FsiTube {
    spec: Spec,
    /// Region of each cell.
    region: Vec<usize>,
    n_region: usize,
    step: f64,
    start: Start,
    /// Pressure under which the radius is R; zero for the radius without load.
    image_pressure: f64,
}

impl FsiTube {
    /// Makes a tube in this layout; `length` in cm is what its listed regions must cover, and cover in proportion when the
    /// parameter `L` has another value.
    ///
    /// # Errors
    /// When the layout cannot be; the error says where.
    pub fn new(layout: &Layout, length: f64) -> Result<Self, SetupError> {
        let parts = layout.parts(length)?;
        let region = parts.iter().enumerate().flat_map(|(i, part)| std::iter::repeat_n(i, part.n_cell));
        Ok(Self {
            spec: quantities::spec(layout.cells, &parts),
            region: region.collect(),
            n_region: parts.len(),
            step: layout.step,
            start: layout.start,
            image_pressure: layout.image_pressure,
        })
    }

    /// Makes the tube of a study.
    ///
    /// # Errors
    /// When its layout cannot be read, or cannot be.
    pub(super) fn build(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
        let layout: Layout = starlings_models_core::layout::read(def)?;
        let length = def.constants.get("L").copied().unwrap_or(quantities::LENGTH);
        Ok(Box::new(Self::new(&layout, length)?))
    }

    fn n_cell(&self) -> usize {
        self.region.len()
    }

    fn coefficients(&self, theta: &[f64]) -> Coefficients {
        Coefficients::new(&theta[self.n_region..], self.n_cell())
    }

    /// Writes the stiffness of wall and tissue in every cell.
    fn stiffness(&self, theta: &[f64], c: &Coefficients, stiffness: &mut [f64]) {
        let mut known = None;
        for (k, &region) in stiffness.iter_mut().zip(&self.region) {
            // Cells of a region follow each other.
            let of_region = match known {
                Some((of, value)) if of == region => value,
                _ => self.of_young(c, theta[region]),
            };
            known = Some((region, of_region));
            *k = of_region;
        }
    }

    /// The stiffness of wall and tissue for a Young's modulus; NaN where the image has no unloaded radius.
    fn of_young(&self, c: &Coefficients, young: f64) -> f64 {
        if self.image_pressure > 0.0 {
            return c.stiffness_at(young, self.unloaded(c, young));
        }
        c.stiffness(young)
    }

    /// The radius without load of a wall of this Young's modulus; NaN where the image has none.
    fn unloaded(&self, c: &Coefficients, young: f64) -> f64 {
        if self.image_pressure > 0.0 {
            let ring = Rings { membrane: vec![c.membrane(young)], support: c.tissue };
            let unloaded = ring.unloaded(&[c.radius], self.image_pressure);
            return unloaded.map_or(f64::NAN, |found| found.shape[0]);
        }
        c.radius
    }

    /// Writes strain and stress of the wall in every cell.
    fn wall(&self, x: &[f64], theta: &[f64], c: &Coefficients, [strain, stress]: [&mut [f64]; 2]) {
        let n = self.n_cell();
        let mut known = None;
        for (k, &region) in self.region.iter().enumerate() {
            // Cells of a region follow each other.
            let unloaded = match known {
                Some((of, radius)) if of == region => radius,
                _ => self.unloaded(c, theta[region]),
            };
            known = Some((region, unloaded));
            let stretch = x[k] + c.radius - unloaded;
            [strain[k], stress[k]] = c.strain_and_stress(theta[region], unloaded, stretch, x[n + k]);
        }
    }

    /// Flow out of the tube: what flows in and does not widen the wall.
    fn outflow(&self, c: &Coefficients, inflow: f64, x: &[f64]) -> f64 {
        let n = self.n_cell();
        inflow - c.area * x[n..2 * n].iter().sum::<f64>()
    }

    /// Writes the acceleration of the wall and returns the pressure in the first cell.
    fn acceleration(&self, x: &[f64], theta: &[f64], u: Drive<'_>, dw: &mut [f64]) -> f64 {
        let (c, n) = (self.coefficients(theta), self.n_cell());
        let (eta, w, pi) = (&x[..n], &x[n..2 * n], x[2 * n]);
        let wall = vec![c.mass * c.per_area; n];
        let (mut inverse, mut ratio) = (vec![0.0; n], vec![0.0; n]);
        let chain = Chain::factor(c.inertance, &wall, 0.0, &mut inverse, &mut ratio);
        let mut stiffness = vec![0.0; n];
        self.stiffness(theta, &c, &mut stiffness);
        // The pressure in a cell but for the wall's inertia.
        let pressure = |k: usize| self.image_pressure + stiffness[k] * eta[k] + c.damping * w[k];
        let mut flow = u.value[0];
        let mut behind = pressure(0);
        for k in 0..n {
            flow -= c.area * w[k];
            let (friction, ahead) = match k + 1 {
                next if next < n => (c.friction, pressure(next)),
                _ => (0.5 * c.friction, pi + c.proximal * flow),
            };
            dw[k] = behind - ahead - friction * flow;
            behind = ahead;
        }
        dw[0] += wall[0] * u.slope[0];
        chain.solve(dw);
        let mut above = u.slope[0];
        for dw in dw.iter_mut() {
            (above, *dw) = (*dw, (above - *dw) * c.per_area);
        }
        pressure(0) + c.mass * dw[0]
    }
}

impl Model for FsiTube {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// At rest under the pressure p0: η = (p0 − p_i)/(k + k_s).
    fn initial(&self, theta: &[f64], x: &mut [f64]) {
        let c = self.coefficients(theta);
        let State { eta, w, pi } = State::of(x);
        for (eta, &region) in eta.iter_mut().zip(&self.region) {
            let young = match self.start {
                Start::Equilibrium => theta[region],
                Start::Reference => c.young_ref,
            };
            *eta = (c.p0 - self.image_pressure) / self.of_young(&c, young);
        }
        w.fill(0.0);
        *pi = c.p0;
    }

    fn rhs(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, dx: &mut [f64]) {
        let (c, n) = (self.coefficients(theta), self.n_cell());
        dx[..n].copy_from_slice(&x[n..2 * n]);
        self.acceleration(x, theta, u, &mut dx[n..2 * n]);
        dx[2 * n] = (self.outflow(&c, u.value[0], x) - x[2 * n] / c.distal) / c.compliance;
    }

    fn output(&self, _t: f64, x: &[f64], theta: &[f64], u: Drive<'_>, y: &mut [f64]) {
        let (c, n) = (self.coefficients(theta), self.n_cell());
        // The velocities' places hold the accelerations until the inlet's pressure is known.
        let first = self.acceleration(x, theta, u, &mut y[n..2 * n]);
        y[2 * n + 2] = first + 0.5 * (c.inertance * u.slope[0] + c.friction * u.value[0]);
        y[..2 * n].copy_from_slice(&x[..2 * n]);
        let outflow = self.outflow(&c, u.value[0], x);
        y[2 * n] = x[2 * n] + c.proximal * outflow;
        y[2 * n + 1] = outflow;
        let (strain, stress) = y[2 * n + 3..].split_at_mut(n);
        self.wall(x, theta, &c, [strain, stress]);
    }

    fn blocks(&self, theta: &[f64]) -> Option<Blocks> {
        Some(self.structure(theta))
    }

    /// Implicit midpoint steps of one length, none longer than the layout's.
    fn advance(&self, segment: Segment<'_>, theta: &[f64], x: &mut [f64]) -> Result<(), ModelFailure> {
        // A hair of the layout's step is no step of its own: a segment is as long as its times' rounding lets it be.
        const HAIR: f64 = 1e-6;
        let h = segment.t1 - segment.t0;
        let n = (h / self.step - HAIR).ceil().max(1.0);
        if n > MOST_STEPS as f64 {
            return Err(ModelFailure::TooManySteps { time: segment.t0, limit: MOST_STEPS });
        }
        segment.limits.foresee(h / n, segment.t0)?;
        self.midpoint(theta, segment, n as usize, State::of(x))
    }
}
