//! The end of the bore: a choked nozzle of a given throat.
//!
//! The flow from the bore's end to the throat is isentropic and quasi-steady, so that the ratio of both areas sets the Mach number at
//! the end; the wave that arrives from the bore sets the rest. The nozzle stays choked whatever the pressure outside. Next file
//! to read: [`super::faults`].

use super::gas::Gas;

/// The subsonic Mach number at which a flow is choked by a throat of this share of its area (Shapiro 1953, eq. 4.19).
pub(super) fn mach(share: f64, gamma: f64) -> f64 {
    if share >= 1.0 {
        return 1.0;
    }
    let power = 0.5 * (gamma + 1.0) / (gamma - 1.0);
    let flow = |m: f64| m * (2.0 / (gamma + 1.0) * (1.0 + 0.5 * (gamma - 1.0) * m * m)).powf(-power);
    // The flow is concave in m and below the share here, so that Newton's steps never pass the solution.
    let mut m = share * (2.0 / (gamma + 1.0)).powf(power);
    for _ in 0..60 {
        let f = flow(m);
        if f <= 0.0 {
            break;
        }
        let slope = f * (1.0 / m - 0.5 * (gamma + 1.0) * m / (1.0 + 0.5 * (gamma - 1.0) * m * m));
        let step = (share - f) / slope;
        if step.abs() <= 1e-15 || step.is_nan() {
            break;
        }
        m = (m + step).min(1.0);
    }
    m
}

/// The gas at the end of the bore, from the gas that arrives there and the Mach number that the nozzle sets: same entropy, same
/// u + 2c/(γ − 1).
pub(super) fn gas(inside: Gas, mach: f64, gamma: f64) -> Gas {
    let c = inside.sound(gamma);
    let arriving = inside.u + 2.0 * c / (gamma - 1.0);
    let sound = arriving / (mach + 2.0 / (gamma - 1.0));
    let ratio = (sound / c).powf(2.0 / (gamma - 1.0));
    Gas { rho: inside.rho * ratio, u: mach * sound, p: inside.p * ratio.powf(gamma) }
}

/// Pressure of this gas brought to rest without loss.
pub(super) fn stagnation(gas: Gas, gamma: f64) -> f64 {
    let mach = gas.u / gas.sound(gamma);
    gas.p * (1.0 + 0.5 * (gamma - 1.0) * mach * mach).powf(gamma / (gamma - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nozzle;

    #[test]
    fn the_mach_number_is_that_of_the_tables() {
        // Anderson 2003, app. A, γ = 1.4: A/A* = 2.0351 at M = 0.30 and 1.1451 at M = 0.64, to its digits.
        assert!((mach(1.0 / 2.0351, 1.4) - 0.30).abs() < 1e-4);
        assert!((mach(1.0 / 1.1451, 1.4) - 0.64).abs() < 1e-4);
        assert!(mach(0.0, 1.2).abs() < 1e-300 && (mach(1.0, 1.2) - 1.0).abs() < 1e-15);
        assert!((mach(0.999_999, 1.2) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn the_nozzle_passes_the_choked_flow_of_the_gas_brought_to_rest() {
        let gamma = 1.2;
        let share = 0.35;
        let end = gas(Gas { rho: 5.0, u: 150.0, p: 5e6 }, mach(share, gamma), gamma);
        let p = stagnation(end, gamma);
        let rho = end.rho * (p / end.p).powf(1.0 / gamma);
        let choked = nozzle::choked(gamma) * share * (gamma * p * rho).sqrt();
        assert!((end.rho * end.u / choked - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_closed_end_is_a_wall() {
        let end = gas(Gas { rho: 1.0, u: 0.1, p: 1.0 }, 0.0, 1.4);
        assert!(end.u.abs() < 1e-300 && end.p > 1.0);
        let still = gas(Gas { rho: 1.0, u: 0.0, p: 1.0 }, 0.0, 1.4);
        assert!((still.p - 1.0).abs() < 1e-14 && (still.rho - 1.0).abs() < 1e-14);
    }
}
