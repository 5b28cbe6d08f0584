//! The neutral motor of the miss and of the false alarm (`motor.rs` has the equations; V = 1 + 2(R − 1) here, and a makes the nominal
//! pressure one): its throat loses area from a known time on.

use std::sync::Arc;

use starlings_estimators::forecast::Level;
use starlings_estimators::inference::{Basis, Function, Rule, Structure};

use super::motor::{EXPONENT, GAMMA, PROPELLANT};
use super::sde::{heun, rng};

pub const RATE: f64 = 0.008;
/// Time of the fault.
pub const FAULT: f64 = 9.0;
/// Pressure at which the case bursts, and that of the alarm before it.
pub const BURST: f64 = 1.55;
/// Sampling interval of recordings.
pub const H: f64 = 0.005;
/// Coefficients of the miss: A = 1 − (α τ + β τ² + δ τ³).
pub const MISS: [f64; 3] = [0.002, 0.0001, 0.00042];

/// The throat's area after the fault of the miss.
pub fn polynomial(c: [f64; 3]) -> impl Fn(f64) -> f64 {
    move |t| {
        let tau = (t - FAULT).max(0.0);
        (1.0 - tau * (c[0] + tau * (c[1] + tau * c[2]))).max(0.05)
    }
}

/// The throat's area while a cloud of particles passes.
pub fn cloud(t: f64) -> f64 {
    if t < FAULT { 1.0 } else { 1.0 - 0.15 * (-(t - FAULT) / 0.6).exp() }
}

fn outflow(p: f64, rho: f64, r: f64) -> [f64; 2] {
    let of = RATE * PROPELLANT / (1.0 + 2.0 * (r - 1.0));
    [of * p * (p / rho).sqrt(), of / GAMMA * (p * rho).sqrt()]
}

fn burning(p: f64, rho: f64, r: f64) -> [f64; 2] {
    let dense = PROPELLANT / 2.0 / GAMMA;
    let burn = RATE * 2.0 / (1.0 + 2.0 * (r - 1.0)) * p.powf(EXPONENT);
    [burn * (GAMMA * dense - p), burn * (dense - rho)]
}

/// Rows p, ρ, R from a state at the time `from` on: `n` of them `substeps` steps of `step` apart, with noise of the amplitude d.
pub fn course(
    seed: u64,
    (from, start): (f64, [f64; 3]),
    n: usize,
    (step, substeps): (f64, usize),
    d: f64,
    area: impl Fn(f64) -> f64,
) -> Vec<[f64; 3]> {
    let mut rng = rng(seed);
    let root = [[d, 0.0, 0.0], [0.0, d, 0.0], [0.0; 3]];
    let drift = |t: f64, [p, rho, r]: &[f64; 3]| {
        let (p, rho) = (p.max(1e-3), rho.max(1e-3));
        let (out, burnt) = (outflow(p, rho, *r), burning(p, rho, *r));
        let area = area(t);
        [burnt[0] - area * out[0], burnt[1] - area * out[1], RATE * p.powf(EXPONENT)]
    };
    let (mut x, mut rows) = (start, vec![start]);
    for k in 0..n {
        for j in 0..substeps {
            let t = from + step * (k * substeps + j) as f64;
            x = heun(&mut rng, (t, step), &x, &root, &drift);
        }
        rows.push(x);
    }
    rows
}

/// A recording from the start up to a time.
pub fn recording(seed: u64, until: f64, d: f64, area: impl Fn(f64) -> f64) -> Vec<[f64; 3]> {
    let n = (until / H).round() as usize;
    course(seed, (0.0, [1.0; 3]), n, (H / 10.0, 10), d, area)
}

/// The time at which the pressure of rows `h` apart, of which the first is at `from`, crosses a level.
pub fn crossing(rows: &[[f64; 3]], from: f64, h: f64, level: f64) -> Option<f64> {
    let times: Vec<f64> = (0..rows.len()).map(|k| from + k as f64 * h).collect();
    let pressure: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    Level::above(level).first_crossing(&times, &pressure)
}

/// Outflow of either equation times powers of the time since the recording's first row, and what is known.
pub fn basis(powers: i32) -> Arc<Basis> {
    let mut basis = Basis::new(2, 1);
    for (k, of) in ["p", "rho"].into_iter().enumerate() {
        for power in 0..powers {
            let value = move |t: f64, x: &[f64]| t.powi(power) * outflow(x[0], x[1], x[2])[k];
            let own = if k == 0 { 1.5 } else { 0.5 };
            let slopes = move |t: f64, x: &[f64], slopes: &mut [f64]| {
                slopes[k] = own * t.powi(power) * outflow(x[0], x[1], x[2])[k] / x[k];
            };
            basis =
                basis.with(Rule::MidPoint, Function::new(format!("out_{of}{power}"), value, slopes)).unwrap();
        }
        // A known term needs no slopes.
        let value = move |_: f64, x: &[f64]| burning(x[0], x[1], x[2])[k];
        let known = Function::new(format!("burn_{of}"), value, |_, _, _| ());
        basis = basis.with(Rule::MidPoint, known).unwrap();
    }
    Arc::new(basis)
}

/// What is known of both equations: what burns, and the outflow of the whole throat where `whole`.
fn known(basis: &Basis, whole: bool) -> Structure {
    let mut structure = Structure::new(basis, &["p", "rho"]).unwrap();
    for of in ["p", "rho"] {
        structure = structure.known(of, &format!("burn_{of}"), 1.0).unwrap();
        if whole {
            structure = structure.known(of, &format!("out_{of}0"), -1.0).unwrap();
        }
    }
    structure
}

/// α, β and δ of the throat's loss from both equations.
pub fn loss(basis: &Basis) -> Structure {
    let names = [("alpha", 1), ("beta", 2), ("delta", 3)];
    names.into_iter().fold(known(basis, true), |structure, (name, power)| {
        let [p, rho] = ["p", "rho"].map(|of| format!("out_{of}{power}"));
        structure.with(name, &[("p", &p, 1.0), ("rho", &rho, 1.0)]).unwrap()
    })
}

/// The throat's area and its rate from both equations.
pub fn area(basis: &Basis) -> Structure {
    [("area", 0), ("rate", 1)].into_iter().fold(known(basis, false), |structure, (name, power)| {
        let [p, rho] = ["p", "rho"].map(|of| format!("out_{of}{power}"));
        structure.with(name, &[("p", &p, -1.0), ("rho", &rho, -1.0)]).unwrap()
    })
}
