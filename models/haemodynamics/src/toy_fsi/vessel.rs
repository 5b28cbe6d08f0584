//! The vessel of the toy systems: a planar channel between a plane of symmetry and a generalised string.
//!
//! The fluid fills (0, L) × (0, R); the wall at y = R obeys m d²d/dt² + a d − b ∂²d/∂x² = p with m = ρs h, a = E h/((1 − ν²) R²)
//! and b = k_T G h, G = E/(2 (1 + ν)) (Quarteroni, Tuveri & Veneziani 2000). Every wave number κ along the wall has its own
//! added mass in a potential flow, ρf/(κ tanh κR) (Causin, Gerbeau & Nobile 2005). Nothing here knows a discretisation. Next
//! file to read: [`super::spectral`].

use starlings_models_core::{Quantity, Role};

/// Geometry and materials of a vessel, cgs units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Vessel {
    /// Length L.
    pub(crate) length: f64,
    /// Radius R, the half height of the channel.
    pub(crate) radius: f64,
    /// Wall thickness h.
    pub(crate) thickness: f64,
    /// Young's modulus E.
    pub(crate) young: f64,
    /// Poisson's ratio ν.
    pub(crate) poisson: f64,
    /// Density ρs of the wall.
    pub(crate) solid_density: f64,
    /// Density ρf of the fluid.
    pub(crate) fluid_density: f64,
    /// Timoshenko's shear correction k_T.
    pub(crate) shear_correction: f64,
    /// Retardation time τ of a Kelvin–Voigt wall: stiffness times τ is its damping.
    pub(crate) retardation: f64,
}

impl Vessel {
    /// Number of parameters, the first ones of every toy model.
    pub(crate) const N: usize = 9;

    /// The parameters with the values of a large artery.
    pub(crate) fn parameters() -> Vec<Quantity> {
        let positive = |name, unit, value| Quantity::new(name, unit).positive().default(value);
        vec![
            positive("L", "cm", 10.0).says("Length of the vessel."),
            positive("R", "cm", 1.0).says("Radius: half height of the channel."),
            positive("h", "cm", 0.15).says("Thickness of the wall."),
            positive("E", "dyn/cm^2", 5e6).role(Role::Stiffness).says("Young's modulus of the wall."),
            Quantity::new("nu", "").range(0.0, 0.5).default(0.5).says("Poisson's ratio of the wall."),
            positive("rho_s", "g/cm^3", 1.1).role(Role::Inertia).says("Density of the wall."),
            positive("rho_f", "g/cm^3", 1.06).role(Role::Inertia).says("Density of the fluid."),
            positive("k_T", "", 5.0 / 6.0).says("Shear correction of the wall (Timoshenko)."),
            Quantity::new("tau", "s")
                .role(Role::Damping)
                .range(0.0, f64::INFINITY)
                .default(0.0)
                .says("Retardation time of the wall: its damping over its stiffness (Kelvin and Voigt)."),
        ]
    }

    /// Reads the first [`Vessel::N`] parameters.
    pub(crate) fn read(theta: &[f64]) -> Self {
        Self {
            length: theta[0],
            radius: theta[1],
            thickness: theta[2],
            young: theta[3],
            poisson: theta[4],
            solid_density: theta[5],
            fluid_density: theta[6],
            shear_correction: theta[7],
            retardation: theta[8],
        }
    }

    /// m, the mass of the wall per area.
    pub(crate) fn mass(&self) -> f64 {
        self.solid_density * self.thickness
    }

    /// a, the stiffness of a ring per area.
    pub(crate) fn ring(&self) -> f64 {
        self.young * self.thickness / ((1.0 - self.poisson * self.poisson) * self.radius * self.radius)
    }

    /// b, the shear stiffness along the wall.
    pub(crate) fn shear(&self) -> f64 {
        self.shear_correction * self.young / (2.0 * (1.0 + self.poisson)) * self.thickness
    }

    /// a + b κ², the stiffness of the wall per area at a wave number.
    pub(crate) fn stiffness(&self, wave_number: f64) -> f64 {
        self.ring() + self.shear() * wave_number * wave_number
    }

    /// ρf/(κ tanh κR), the added mass of a potential flow per area at a wave number.
    pub(crate) fn added_mass(&self, wave_number: f64) -> f64 {
        self.fluid_density / (wave_number * (wave_number * self.radius).tanh())
    }
}

/// The displacement of the wall when it is let go, at ξ = x/L: three sine modes, so that more than one combination of
/// stiffness and mass shows in its motion.
pub(crate) fn bump(height: f64, xi: f64) -> f64 {
    let sine = |i: f64| (i * std::f64::consts::PI * xi).sin();
    height * (sine(1.0) + 0.5 * sine(2.0) + 0.25 * sine(3.0))
}

/// The parameter behind [`bump`].
pub(crate) fn bump_parameter() -> Quantity {
    Quantity::new("bump", "cm").role(Role::Displacement).default(0.1).says(
        "Amplitude of the first sine mode of the initial displacement; the second has half, the third a quarter of it.",
    )
}

/// Fields of the displacement and the velocity at `n` places of the wall: outputs of every toy model, states of most.
pub(crate) fn wall_fields(n: usize) -> Vec<Quantity> {
    vec![
        Quantity::new("displacement", "cm")
            .role(Role::Displacement)
            .size(n)
            .says("Radial displacement of the wall."),
        Quantity::new("velocity", "cm/s").role(Role::Velocity).size(n).says("Radial velocity of the wall."),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_artery_has_the_coefficients_of_its_defaults() {
        let theta: Vec<f64> = Vessel::parameters().iter().filter_map(|q| q.default).collect();
        let vessel = Vessel::read(&theta);
        assert_eq!(theta.len(), Vessel::N);
        // Round numbers of the defaults, up to the rounding of a few products.
        assert!((vessel.mass() - 0.165).abs() < 1e-15);
        assert!((vessel.ring() - 1e6).abs() < 1e-8);
        assert!((vessel.shear() - 625_000.0 / 3.0).abs() < 1e-8);
    }

    #[test]
    fn the_added_mass_of_long_waves_is_that_of_a_thin_channel_and_of_short_ones_that_of_deep_water() {
        let theta: Vec<f64> = Vessel::parameters().iter().filter_map(|q| q.default).collect();
        let vessel = Vessel::read(&theta);
        // tanh s = s (1 − s²/3) for small s and 1 for large s.
        let long = vessel.added_mass(1e-3) * 1e-6 / 1.06;
        assert!((long - 1.0 - 1e-6 / 3.0).abs() < 1e-11, "{long}");
        assert!((vessel.added_mass(40.0) * 40.0 / 1.06 - 1.0).abs() < 1e-15);
    }
}
