//! The steady flow in a bore of one radius, where every run starts.
//!
//! Between the head and a place where the mass flux is g the momentum gives p + g u = p_h and the energy
//! γ/(γ−1) p/ρ + u²/2 = c_0²/(γ−1), so that u solves (γ+1)/(2(γ−1)) u² − γ/(γ−1) (p_h/g) u + c_0²/(γ−1) = 0 (Shapiro 1953, ch. 8, flow
//! with injection at constant area and enthalpy). The head's pressure is that at which the nozzle passes what burns. Next file to
//! read: [`super::motor`].

use std::f64::consts::PI;

use super::gas::Gas;
use super::motor::Motor;
use crate::nozzle;

/// The gas in every cell; at rest at the pressure p_c where no steady flow exists.
pub(super) fn cells(motor: &Motor) -> Vec<Gas> {
    let rest = Gas { rho: motor.gamma * motor.p_c / motor.c_0.powi(2), u: 0.0, p: motor.p_c };
    let found = head_pressure(motor).and_then(|p| march(motor, p));
    found.map_or_else(|| vec![rest; motor.n_cell], |(cells, _)| cells)
}

/// The pressure at the head, by bisection of its logarithm.
fn head_pressure(motor: &Motor) -> Option<f64> {
    // Above 300 times the pressure of the lumped chamber the burning, which grows less than the outflow, cannot keep up.
    let (mut low, mut high) = (0.0, 6.0_f64);
    let lumped = lumped(motor);
    if !(lumped > 0.0 && lumped.is_finite()) {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let too_low = match march(motor, lumped * middle.exp()) {
            Some((_, end)) => end.rho * end.u * PI * motor.r_0 * motor.r_0 > capacity(motor, end),
            None => true,
        };
        if too_low { low = middle } else { high = middle }
    }
    Some(lumped * high.exp())
}

/// The pressure at which the whole bore burns what the throat passes of gas at rest, which is below that at the head.
fn lumped(motor: &Motor) -> f64 {
    let surface = 2.0 * PI * motor.r_0 * motor.dx * motor.n_cell as f64;
    let gas = |p: f64| nozzle::choked(motor.gamma) * motor.throat * motor.gamma * p / motor.c_0;
    let exponent = (motor.burning(2.0) / motor.burning(1.0)).log2();
    (surface * motor.burning(1.0) / gas(1.0)).powf(1.0 / (1.0 - exponent))
}

/// Mass flow of the throat for the gas at the end of the bore.
fn capacity(motor: &Motor, end: Gas) -> f64 {
    let gamma = motor.gamma;
    let p = super::exit::stagnation(end, gamma);
    let rho = end.rho * (p / end.p).powf(1.0 / gamma);
    nozzle::choked(gamma) * motor.throat * (gamma * p * rho).sqrt()
}

/// The gas at the cells' centres and at the end of the bore, for a pressure at the head; none where the flow would choke on its way.
fn march(motor: &Motor, head: f64) -> Option<(Vec<Gas>, Gas)> {
    let mut flux = 0.0;
    let (mut cells, mut p) = (Vec::with_capacity(motor.n_cell), head);
    for _ in 0..motor.n_cell {
        let mut own = at(motor, head, flux)?;
        // The burning of a cell depends on the pressure at its centre and changes it by little.
        for _ in 0..4 {
            own = at(motor, head, flux + motor.dx / motor.r_0 * motor.burning(p))?;
            p = own.p;
        }
        flux += 2.0 * motor.dx / motor.r_0 * motor.burning(p);
        cells.push(own);
    }
    Some((cells, at(motor, head, flux)?))
}

/// The gas where the mass flux is `g`.
pub(super) fn at(motor: &Motor, head: f64, g: f64) -> Option<Gas> {
    let gamma = motor.gamma;
    let (a, b, c) = (0.5 * (gamma + 1.0) / (gamma - 1.0), gamma / (gamma - 1.0) * head, motor.enthalpy());
    let root = (b * b - 4.0 * a * c * g * g).sqrt();
    let u = 2.0 * c * g / (b + root);
    let p = head - g * u;
    let rho = gamma / (gamma - 1.0) * p / (c - 0.5 * u * u);
    let gas = Gas { rho, u, p };
    gas.is_sound().then_some(gas)
}
