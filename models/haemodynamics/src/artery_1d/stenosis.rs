//! A narrowing between two ends of vessels: the loss of pressure after Young & Tsai (1973).
//!
//! Δp = K_v μ Q/(2πR0³) + K_t ρ/(2A0²) (A0/As − 1)² |Q| Q + K_u (ρ L/A0) dQ/dt with the empirical constants K_t = 1.52, K_u = 1.2 and
//! K_v = 32 (La/D0)(A0/As)², La = 0.83 L + 1.64 Ds (Young & Tsai 1973, J. Biomech. 6, 395 and 547; in this form Stergiopulos, Young &
//! Rogge 1992). The flow through the narrowing is a state. The loss and the viscous pressures of the walls on its two sides are implicit in time,
//! so that a loss as large as one likes asks for no shorter step; what waves bring is explicit. Next file to read: [`super::pressures`].

use std::f64::consts::PI;

use super::Fault;
use super::network::Narrowing;
use super::vessels::Vessels;

/// The largest part of the area that may be missing: what is left passes a hundredth of the vessel.
pub(super) const MOST_SEVERE: f64 = 0.99;
/// K_t of Young & Tsai's measurements.
pub(super) const TURBULENT: f64 = 1.52;
/// K_u of the same.
pub(super) const UNSTEADY: f64 = 1.2;

/// Loss of total pressure a Q + b |Q| Q + l dQ/dt in cgs units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Loss {
    /// a in dyn s/cm⁵.
    pub(super) viscous: f64,
    /// b in dyn s²/cm⁸.
    pub(super) turbulent: f64,
    /// l in dyn s²/cm⁵.
    pub(super) inertance: f64,
    /// Part of the area that is missing, 1 − As/A0.
    severity: f64,
}

impl Loss {
    /// That of a narrowing with severity 1 − As/A0, K_t and K_u, in blood of viscosity μ and density ρ.
    pub(super) fn new(of: &Narrowing, [severity, turbulent, unsteady]: [f64; 3], mu: f64, rho: f64) -> Self {
        let (diameter, area) = (2.0 * of.radius, PI * of.radius * of.radius);
        let ratio = 1.0 / (1.0 - severity);
        let throat = diameter * (1.0 - severity).sqrt();
        let viscous = 32.0 * (0.83 * of.length + 1.64 * throat) / diameter * ratio * ratio;
        Self {
            viscous: viscous * mu / (2.0 * PI * of.radius.powi(3)),
            turbulent: turbulent * rho / (2.0 * area * area) * (ratio - 1.0).powi(2),
            inertance: unsteady * rho * of.length / area,
            severity,
        }
    }

    /// The loss of a steady flow.
    pub(super) fn steady(self, flow: f64) -> f64 {
        (self.viscous + self.turbulent * flow.abs()) * flow
    }

    /// Its derivative with respect to the flow.
    pub(super) fn slope(self, flow: f64) -> f64 {
        self.viscous + 2.0 * self.turbulent * flow.abs()
    }

    /// The flow q with l q + τ (a q + b |q| q) = l r.
    fn slowed(self, tau: f64, flow: f64) -> f64 {
        let (linear, pushed) = (self.inertance + tau * self.viscous, self.inertance * flow);
        let root = (linear * linear + 4.0 * tau * self.turbulent * pushed.abs()).sqrt();
        2.0 * pushed / (linear + root)
    }
}

impl Vessels<'_> {
    /// Refuses narrowings that leave no way, which only values outside the ranges of their parameters make.
    ///
    /// # Errors
    /// When a severity is not within 0 and [`MOST_SEVERE`].
    pub(super) fn open(&self) -> Result<(), Fault> {
        for (loss, narrowing) in self.losses.iter().zip(&self.network.narrowings) {
            if !(0.0..=MOST_SEVERE).contains(&loss.severity) {
                let name = self.network.nodes[narrowing.nodes[0]].name.clone();
                return Err(Fault::Severity { name, severity: loss.severity });
            }
        }
        Ok(())
    }

    /// Slows the flows through narrowings between walls without viscosity, and writes the implicit part of their rates.
    pub(super) fn slow(&self, tau: f64, x: &mut [f64], rate: &mut [f64]) {
        for (k, loss) in self.losses.iter().enumerate() {
            let at = self.narrowed + k;
            x[at] = loss.slowed(tau, x[at]);
            rate[at] = -loss.steady(x[at]) / loss.inertance;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loss(severity: f64) -> Loss {
        let of = Narrowing { nodes: [0, 1], length: 2.0, radius: 0.3 };
        Loss::new(&of, [severity, TURBULENT, UNSTEADY], 0.04, 1.06)
    }

    #[test]
    fn coefficients_are_those_of_young_and_tsai() {
        // A0/As = 4, Ds = D0/2: K_v = 32 (0.83 · 2 + 1.64 · 0.3)/0.6 · 16.
        let (found, area) = (loss(0.75), PI * 0.09);
        let viscous = 32.0 * 2.152 / 0.6 * 16.0 * 0.04 / (2.0 * PI * 0.027);
        // A few roundings.
        assert!((found.viscous / viscous - 1.0).abs() < 1e-14, "{found:?}");
        assert!(
            (found.turbulent / (1.52 * 1.06 / (2.0 * area * area) * 9.0) - 1.0).abs() < 1e-14,
            "{found:?}"
        );
        assert!((found.inertance / (1.2 * 1.06 * 2.0 / area) - 1.0).abs() < 1e-14, "{found:?}");
    }

    #[test]
    fn a_slowed_flow_fits_its_equation_in_either_direction() {
        for (severity, flow) in [(0.0, 5.0), (0.9, 5.0), (0.99, -80.0), (0.9, 0.0)] {
            let (loss, tau) = (loss(severity), 1e-3);
            let q = loss.slowed(tau, flow);
            let left = loss.inertance * (q - flow) + tau * loss.steady(q);
            // Roundings of terms of the size of the flow's momentum.
            assert!(left.abs() <= 1e-13 * loss.inertance * flow.abs(), "{severity}, {flow}: {left}");
            let slope = (loss.steady(q + 1e-4) - loss.steady(q - 1e-4)) / 2e-4;
            // Differences of a quadratic; at zero the kink of |q| q adds its step.
            assert!((slope - loss.slope(q)).abs() <= 1e-4 * loss.turbulent + 1e-7 * slope, "{slope}");
        }
    }
}
