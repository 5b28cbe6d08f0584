//! A simply supported rectangular plate: the sines that are its normal modes, and their frequencies.
//!
//! Bending of a thin plate (Kirchhoff 1850); shear and rotary inertia are left out. Next file to read: [`super::overlap`].

use std::f64::consts::PI;

/// A plate and how many of its modes are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Lengths Lx and Ly in m.
    pub length: [f64; 2],
    /// Modes in each direction; mode (m, n) is sin(mπx/Lx) sin(nπy/Ly), n runs faster.
    pub modes: [usize; 2],
}

/// What a plate is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Flexural stiffness D in N m.
    pub stiffness: f64,
    /// Mass per area ρh in kg/m².
    pub mass: f64,
    /// Rate δ at which every mode decays, in 1/s.
    pub decay: f64,
}

impl Material {
    /// A sandwich of two faces around a core: D = E_f t_f³/6 + E_c t_c³/12 + E_f t_f (t_f + t_c)²/2, ρh = 2 ρ_f t_f + ρ_c t_c
    /// (Allen 1969, ch. 2). Each layer is Young's modulus in Pa, thickness in m, density in kg/m³.
    pub fn sandwich([e_f, t_f, rho_f]: [f64; 3], [e_c, t_c, rho_c]: [f64; 3], decay: f64) -> Self {
        let stiffness =
            e_f * t_f.powi(3) / 6.0 + e_c * t_c.powi(3) / 12.0 + e_f * t_f * (t_f + t_c).powi(2) / 2.0;
        Self { stiffness, mass: 2.0 * rho_f * t_f + rho_c * t_c, decay }
    }
}

impl Geometry {
    /// Number of modes.
    pub fn n_mode(&self) -> usize {
        self.modes[0] * self.modes[1]
    }

    /// The numbers (m, n) of the modes in their order.
    fn numbers(&self) -> impl Iterator<Item = [f64; 2]> {
        let [nx, ny] = self.modes;
        (1..=nx).flat_map(move |m| (1..=ny).map(move |n| [m as f64, n as f64]))
    }

    /// Circular frequencies in 1/s: ω_mn = π² √(D/ρh) ((m/Lx)² + (n/Ly)²) (Leissa 1969, eq. 4.20).
    pub fn frequencies(&self, material: &Material) -> Vec<f64> {
        let [lx, ly] = self.length;
        let speed = PI * PI * (material.stiffness / material.mass).sqrt();
        self.numbers().map(|[m, n]| speed * ((m / lx).powi(2) + (n / ly).powi(2))).collect()
    }

    /// Values of all modes at a point in m.
    pub fn shapes(&self, [x, y]: [f64; 2]) -> Vec<f64> {
        let [lx, ly] = self.length;
        self.numbers().map(|[m, n]| (m * PI * x / lx).sin() * (n * PI * y / ly).sin()).collect()
    }

    /// Acceleration of every mode by a unit point force: 4/(ρh Lx Ly) times the mode's value there, in 1/kg.
    pub fn forcing(&self, material: &Material, at: [f64; 2]) -> Vec<f64> {
        let scale = 4.0 / (material.mass * self.length[0] * self.length[1]);
        self.shapes(at).into_iter().map(|shape| scale * shape).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sandwich_of_the_reference_has_its_stiffness_mass_and_frequencies() {
        let material = Material::sandwich([1e11, 0.003, 1580.0], [2e8, 0.03, 110.0], 60.0);
        // Each to the digits that the reference gives.
        assert!((material.stiffness - 164_250.0).abs() < 0.05, "{}", material.stiffness);
        assert!((material.mass - 12.78).abs() < 5e-4, "{}", material.mass);
        let frequencies = Geometry { length: [2.0; 2], modes: [20; 2] }.frequencies(&material);
        assert!((frequencies[0] - 559.44).abs() < 5e-3, "{}", frequencies[0]);
        assert!((frequencies[399] - 223_778.0).abs() < 0.5, "{}", frequencies[399]);
    }
}
