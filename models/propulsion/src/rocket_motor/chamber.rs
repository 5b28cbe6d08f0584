//! The balance of mass and energy of the gas in the chamber, in whatever units.
//!
//! Next file to read: [`super::super::rocket_motor`].

use crate::grain::{Bore, Grain};
use crate::nozzle;

use super::layout::Units;

/// Pressure and density at or below this share of those at the start count as it: an observer may push them below zero.
const LEAST: f64 = 1e-6;

/// A motor at its parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chamber {
    gamma: f64,
    n: f64,
    /// Burning rate at the pressure `p_c`.
    rate: f64,
    pub(super) p_c: f64,
    /// Density of the gas at the start.
    pub(super) rho_c: f64,
    rho_p: f64,
    /// Pressure that the gas of the propellant has over its density: c_0², or γ in scaled units.
    heat: f64,
    /// Outflow over √(pρ): Γ √γ A_t, or κ a V_0/γ in scaled units.
    outflow: f64,
    bore: Bore,
    pub(super) r_0: f64,
    pub(super) r_e: f64,
    k_a: f64,
    /// Thrust in a vacuum over pressure, at the first area of the throat.
    pub(super) thrust: f64,
    /// The throat's area at the start.
    pub(super) area: f64,
    p_a: f64,
}

impl Chamber {
    /// Reads the parameters of [`super::quantities`].
    pub(super) fn read(units: Units, theta: &[f64]) -> Self {
        let [gamma, n, rate, p_c, rho_p, sound, throat, r_0, length, r_e, k_a, c_f, p_a] =
            std::array::from_fn(|i| theta[i]);
        let (rho_c, heat, outflow, pi_length, area) = match units {
            Units::Si => {
                let outflow = nozzle::choked(gamma) * gamma.sqrt() * throat;
                (gamma * p_c / (sound * sound), sound * sound, outflow, std::f64::consts::PI * length, throat)
            }
            Units::Scaled => (sound, gamma, rate * throat * length / gamma, length / (r_0 * r_0), 1.0),
        };
        let bore = Bore { radius: r_0, pi_length };
        // The burning rate of scaled units refers to a pressure of one, whatever that of the start is.
        let reference = if units == Units::Si { p_c } else { 1.0 };
        let rate = rate * reference.powf(-n);
        let thrust = c_f * area;
        Self { gamma, n, rate, p_c, rho_c, rho_p, heat, outflow, bore, r_0, r_e, k_a, thrust, area, p_a }
    }

    /// Mass flow through the throat at a factor of its area.
    pub(super) fn flow(&self, factor: f64, p: f64, rho: f64) -> f64 {
        let (p, rho) = (p.max(LEAST * self.p_c), rho.max(LEAST * self.rho_c));
        self.outflow * factor * nozzle::unchoked(self.p_a / p, self.gamma) * (p * rho).sqrt()
    }

    /// Rates of pressure, density and radius, with the throat at a factor of its area.
    pub(super) fn rates(&self, grain: &Grain, factor: f64, x: &[f64], dx: &mut [f64]) {
        let (p, rho) = (x[0].max(LEAST * self.p_c), x[1].max(LEAST * self.rho_c));
        let web = x[2] - self.r_0;
        let regression = if x[2] < self.r_e { self.rate * p.powf(self.n) } else { 0.0 };
        let volume = grain.volume(self.bore, web);
        let burning = grain.area(self.bore, web) * regression / volume;
        let leaving = self.flow(factor, p, rho) / volume;
        dx[0] = burning * (self.k_a * self.heat * self.rho_p - p) - leaving * self.gamma * p / rho;
        dx[1] = burning * (self.k_a * self.rho_p - rho) - leaving;
        dx[2] = regression;
    }
}
