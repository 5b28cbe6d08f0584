//! The coefficients of the tube's equations at given parameters.
//!
//! Next file to read: [`super::midpoint`].

use std::f64::consts::PI;

/// What the equations need of the parameters, per cell of length dx.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coefficients {
    /// Membrane stiffness per Young's modulus, h/(1 − ν²) in cm.
    plane: f64,
    /// Radius R in cm.
    pub(super) radius: f64,
    /// Wall stiffness per Young's modulus, h/((1 − ν²) R²) in 1/cm.
    pub(super) ring: f64,
    /// Tissue stiffness k_s in dyn/cm³.
    pub(super) tissue: f64,
    /// Mass of the wall per area m = ρ_s h in g/cm².
    pub(super) mass: f64,
    /// Damping of wall and tissue c_w + c_s in dyn s/cm³.
    pub(super) damping: f64,
    /// Damping of the wall alone c_w in dyn s/cm³.
    wall_damping: f64,
    /// Thickness of the wall h in cm.
    thickness: f64,
    /// Area of a cell's wall s = 2π R dx in cm².
    pub(super) area: f64,
    /// 1/s: a product with it costs a fraction of a division.
    pub(super) per_area: f64,
    /// Inertia of the fluid in a cell l dx, with l = ρ_f/A₀.
    pub(super) inertance: f64,
    /// Friction of the fluid in a cell K_r dx, with K_r = 8π μ/A₀² (Poiseuille).
    pub(super) friction: f64,
    /// Proximal resistance R_p.
    pub(super) proximal: f64,
    /// Distal resistance R_d.
    pub(super) distal: f64,
    /// Compliance C.
    pub(super) compliance: f64,
    /// Young's modulus of a start of kind `reference`.
    pub(super) young_ref: f64,
    /// Initial pressure of the Windkessel.
    pub(super) p0: f64,
}

impl Coefficients {
    /// Reads the parameters that follow those of the regions; `n` cells.
    pub(super) fn new(shared: &[f64], n: usize) -> Self {
        let &[young_ref, length, radius, h, nu, rho_s, rho_f, mu, c_w, k_s, c_s, r_p, r_d, c, p0] = shared
        else {
            unreachable!("a tube shares 15 parameters between its regions, not {}", shared.len());
        };
        let dx = length / n as f64;
        let section = PI * radius * radius;
        let area = 2.0 * PI * radius * dx;
        Self {
            plane: h / (1.0 - nu * nu),
            radius,
            ring: h / ((1.0 - nu * nu) * radius * radius),
            tissue: k_s,
            mass: rho_s * h,
            damping: c_w + c_s,
            wall_damping: c_w,
            thickness: h,
            area,
            per_area: 1.0 / area,
            inertance: rho_f / section * dx,
            friction: 8.0 * PI * mu / (section * section) * dx,
            proximal: r_p,
            distal: r_d,
            compliance: c,
            young_ref,
            p0,
        }
    }

    /// β = E h/(1 − ν²) in dyn/cm, for a wall of this Young's modulus.
    pub(super) fn membrane(&self, young: f64) -> f64 {
        self.plane * young
    }

    /// Stiffness of wall and tissue together in dyn/cm³, for a wall of this Young's modulus and unloaded radius.
    pub(super) fn stiffness_at(&self, young: f64, unloaded: f64) -> f64 {
        self.membrane(young) / (unloaded * unloaded) + self.tissue
    }

    /// Circumferential strain and stress of a ring that is `stretch` wider than its unloaded radius and moves with the velocity `w`:
    /// ε = stretch/R and σ = E ε/(1 − ν²) + c_w w R/h, so that σ h/R is the pressure that the wall alone holds.
    pub(super) fn strain_and_stress(&self, young: f64, unloaded: f64, stretch: f64, w: f64) -> [f64; 2] {
        let strain = stretch / unloaded;
        let elastic = self.membrane(young) / self.thickness * strain;
        [strain, elastic + self.wall_damping * w * unloaded / self.thickness]
    }

    /// Stiffness of wall and tissue together k in dyn/cm³, for a wall of this Young's modulus.
    pub(super) fn stiffness(&self, young: f64) -> f64 {
        self.ring * young + self.tissue
    }
}
