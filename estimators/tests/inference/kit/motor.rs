//! A solid rocket motor with a cylindrical grain (Smelyanskiy, Luchinsky et al., eq. 1.32 and Table 1.4), pressure and density in
//! units of their scales, radius in units of its first, time in seconds at a burn rate of a tenth of the radius per second:
//! ṗ = −κ a p √(p/ρ)/R² + κ (2/R) (γ ρ_p − p) pⁿ, ρ̇ = −κ (a/γ) √(pρ)/R² + κ (2/R) (ρ_p − ρ) pⁿ, Ṙ = κ pⁿ.

use std::sync::Arc;

use starlings_estimators::inference::{Basis, Function, Rule, Structure};

use super::sde::{heun, record, rng};

pub const GAMMA: f64 = 1.2;
/// 2 γ ρ_p.
pub const PROPELLANT: f64 = 2575.34;
pub const THROAT: f64 = 1101.75;
pub const EXPONENT: f64 = 0.4;
pub const RATE: f64 = 0.1;
pub const NOISE: f64 = 0.0902;

/// The pressure at which burning and outflow balance.
pub fn equilibrium() -> f64 {
    (PROPELLANT / THROAT).powf(1.0 / (1.0 - EXPONENT))
}

/// Rows p, ρ, R every millisecond from a pressure; the throat's area is `area(t)` of the nominal one.
pub fn recording(seed: u64, n: usize, start: f64, area: impl Fn(f64) -> f64) -> Vec<[f64; 3]> {
    let mut rng = rng(seed);
    let drift = |t: f64, [p, rho, r]: &[f64; 3]| {
        let dense = PROPELLANT / 2.0 / GAMMA;
        let (p, rho) = (p.max(1e-3), rho.max(1e-3));
        let (outflow, burn) = (RATE * THROAT * area(t) / (r * r), RATE * 2.0 / r * p.powf(EXPONENT));
        [
            -outflow * p * (p / rho).sqrt() + burn * (GAMMA * dense - p),
            -outflow / GAMMA * (p * rho).sqrt() + burn * (dense - rho),
            RATE * p.powf(EXPONENT),
        ]
    };
    let d = NOISE.sqrt();
    let root = [[d, 0.0, 0.0], [0.0, d, 0.0], [0.0, 0.0, 0.0]];
    record(n, (0.001, 10), [start, start, 1.0], |t, h, x| heun(&mut rng, (t, h), x, &root, &drift))
}

/// Terms of the pressure's equation; density and radius are known inputs.
pub fn basis() -> Arc<Basis> {
    let source = Function::new(
        "source",
        |_, x| RATE * x[0].powf(EXPONENT) / x[2],
        |_, x, slopes| slopes[0] = RATE * EXPONENT * x[0].powf(EXPONENT - 1.0) / x[2],
    );
    let outflow = Function::new(
        "outflow",
        |_, x| RATE * x[0] * (x[0] / x[1]).sqrt() / (x[2] * x[2]),
        |_, x, slopes| slopes[0] = 1.5 * RATE * (x[0] / x[1]).sqrt() / (x[2] * x[2]),
    );
    let filling = Function::new(
        "filling",
        |_, x| RATE * 2.0 / x[2] * x[0].powf(EXPONENT + 1.0),
        |_, x, slopes| slopes[0] = RATE * 2.0 / x[2] * (EXPONENT + 1.0) * x[0].powf(EXPONENT),
    );
    let basis = Basis::new(1, 2)
        .with(Rule::MidPoint, source)
        .and_then(|b| b.with(Rule::MidPoint, outflow))
        .and_then(|b| b.with(Rule::MidPoint, filling));
    Arc::new(basis.unwrap())
}

/// The throat alone is unknown.
pub fn throat(basis: &Basis) -> Structure {
    Structure::new(basis, &["p"])
        .and_then(|s| s.known("p", "filling", -1.0))
        .and_then(|s| s.known("p", "source", PROPELLANT))
        .and_then(|s| s.with("a", &[("p", "outflow", -1.0)]))
        .unwrap()
}

/// Throat and propellant are unknown.
pub fn pair(basis: &Basis) -> Structure {
    Structure::new(basis, &["p"])
        .and_then(|s| s.known("p", "filling", -1.0))
        .and_then(|s| s.with("propellant", &[("p", "source", 1.0)]))
        .and_then(|s| s.with("a", &[("p", "outflow", -1.0)]))
        .unwrap()
}
