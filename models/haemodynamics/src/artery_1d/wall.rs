//! The elastic wall of a section: pressure against area.
//!
//! A thin ring, linear in its displacement, with tissue around it that pushes back in proportion:
//! p − p_ext = K (R − R0), K = E h/((1 − ν²) R0²) + k_s, R = √(A/π).
//! What the wall's viscosity adds is in [`super::viscous`], the wall's inertia is left out. Next file to read:
//! [`super::vessels`].

use std::f64::consts::PI;

/// A ring of wall and the tissue around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    /// K in dyn/cm³.
    pub(super) stiffness: f64,
    /// R0 in cm.
    pub(super) radius: f64,
}

/// Radius of a circle of this area.
pub(super) fn radius(area: f64) -> f64 {
    (area / PI).sqrt()
}

impl Ring {
    /// R − R0 in cm.
    pub(super) fn displacement(self, area: f64) -> f64 {
        radius(area) - self.radius
    }

    /// p − p_ext in dyn/cm².
    pub(super) fn pressure(self, area: f64) -> f64 {
        self.stiffness * self.displacement(area)
    }

    /// A in cm² under p − p_ext; NaN for a pressure that no open vessel has.
    pub(super) fn area(self, pressure: f64) -> f64 {
        let radius = self.radius + pressure / self.stiffness;
        if radius > 0.0 { PI * radius * radius } else { f64::NAN }
    }

    /// Speed of small waves c = √((A/ρ) dp/dA) (Bramwell & Hill 1922) in cm/s, at rest.
    pub(super) fn speed(self, area: f64, rho: f64) -> f64 {
        (self.stiffness * radius(area) / (2.0 * rho)).sqrt()
    }

    /// ∫ (A/ρ) dp from A = 0, the pressure's part of the momentum flux, in cm⁴/s².
    pub(super) fn impulse(self, area: f64, rho: f64) -> f64 {
        self.stiffness * area * radius(area) / (3.0 * rho)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_and_impulse_are_derivatives_of_the_tube_law() {
        let (ring, rho, area) = (Ring { stiffness: 1e6, radius: 1.1 }, 1.06, 4.0);
        let d = 1e-4;
        let slope = (ring.pressure(area + d) - ring.pressure(area - d)) / (2.0 * d);
        // Central differences: d² times a third derivative of the order of the value.
        let c = ring.speed(area, rho);
        assert!((area / rho * slope / (c * c) - 1.0).abs() < 1e-8);
        let force = (ring.impulse(area + d, rho) - ring.impulse(area - d, rho)) / (2.0 * d);
        assert!((force / (c * c) - 1.0).abs() < 1e-8);
    }

    #[test]
    fn area_inverts_pressure_and_a_closed_vessel_has_none() {
        let ring = Ring { stiffness: 1e6, radius: 1.1 };
        // A few roundings of numbers of this size.
        assert!((ring.area(ring.pressure(4.0)) - 4.0).abs() < 1e-13);
        assert!(ring.area(-1.1e6).is_nan());
    }
}
