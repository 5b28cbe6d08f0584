//! Three tanks with openings at levels and leaks (Smelyanskiy, Luchinsky et al., eqs. 1.19 and 1.20 with the flow between tanks 1
//! and 3 and without what grows in tank 3; t in units of the period of the inflow).

use std::sync::Arc;

use starlings_estimators::inference::{Basis, Function, Rule, Structure};

use super::sde::{heun, record, rng};

pub const NAMES: [&str; 3] = ["h1", "h2", "h3"];
pub const H12: f64 = 0.5;
pub const H13: f64 = 0.6;
pub const H23: f64 = 0.2;
/// eps1 eps2 eps3 c12 c13 c23 L12 L13 L23.
pub const TRUTH: [f64; 9] = [0.1, 0.0, 0.0, 2.0, 2.0, 1.0, 0.07, 0.04, 0.08];
pub const COEFFICIENTS: [&str; 9] = ["eps1", "eps2", "eps3", "c12", "c13", "c23", "L12", "L13", "L23"];
pub const SIGMA: [f64; 3] = [0.03, 0.002, 0.002];

fn positive(z: f64) -> f64 {
    z.max(0.0)
}

fn root(z: f64) -> f64 {
    z.max(0.0).sqrt()
}

fn sine(t: f64) -> f64 {
    (std::f64::consts::TAU * t).sin()
}

/// The inflow, eq. 1.20.
pub fn inflow(t: f64) -> f64 {
    let s = t / 10.0;
    let gate = |z: f64| 0.5 * (1.0 + (100.0 * z).tanh());
    0.2 * gate(0.2 - s) + (gate(0.8 - s) - gate(0.2 - s)) + 0.2 * (gate(1.0 - s) - gate(0.8 - s))
}

pub fn drift(t: f64, h: &[f64; 3]) -> [f64; 3] {
    let [e1, e2, e3, c12, c13, c23, l12, l13, l23] = TRUTH;
    let q12 = c12 * (positive(h[0] - H12) - positive(h[1] - H12));
    let q13 = c13 * (positive(h[0] - H13) - positive(h[2] - H13));
    let q32 = c23 * (positive(h[2] - H23) - positive(h[1] - H23));
    let leaks = l12 * root(h[0] - H12) + l13 * root(h[0] - H13);
    [
        e1 * sine(t) - q12 - q13 - leaks + inflow(t),
        -e2 * sine(t) + q12 + q32 - l23 * root(h[1] - H23),
        e3 * sine(t) + q13 - q32,
    ]
}

/// Twelve seconds from empty tanks, 6000 steps of 2 ms.
pub fn recording(seed: u64) -> Vec<[f64; 3]> {
    let mut rng = rng(seed);
    let noise = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { SIGMA[i] } else { 0.0 }));
    record(6000, (0.002, 5), [0.0; 3], |t, h, x| heun(&mut rng, (t, h), x, &noise, &drift))
}

/// P(h_a − H) − P(h_b − H) with its slopes.
fn flow(name: &str, a: usize, b: usize, level: f64) -> Function {
    let step = |z: f64| if z > 0.0 { 1.0 } else { 0.0 };
    Function::new(
        name,
        move |_, x| positive(x[a] - level) - positive(x[b] - level),
        move |_, x, slopes| {
            slopes[a] = step(x[a] - level);
            slopes[b] = -step(x[b] - level);
        },
    )
}

/// The square root of a level above an opening, whose slope has no bound.
fn leak(name: &str, tank: usize, level: f64) -> Function {
    Function::of_inputs(name, move |_, x| root(x[tank] - level))
}

/// The flows between tanks alone.
pub fn flows() -> Arc<Basis> {
    let basis = Basis::new(3, 0)
        .with(Rule::MidPoint, flow("flow12", 0, 1, H12))
        .and_then(|b| b.with(Rule::MidPoint, flow("flow32", 2, 1, H23)));
    Arc::new(basis.unwrap())
}

pub fn basis() -> Arc<Basis> {
    let basis = Basis::new(3, 0)
        .with(Rule::MidPoint, Function::of_inputs("sine", |t, _| sine(t)))
        .and_then(|b| b.with(Rule::MidPoint, Function::of_inputs("inflow", |t, _| inflow(t))))
        .and_then(|b| b.with(Rule::MidPoint, flow("flow12", 0, 1, H12)))
        .and_then(|b| b.with(Rule::MidPoint, flow("flow13", 0, 2, H13)))
        .and_then(|b| b.with(Rule::MidPoint, flow("flow32", 2, 1, H23)))
        .and_then(|b| b.with(Rule::LeftPoint, leak("leak12", 0, H12)))
        .and_then(|b| b.with(Rule::LeftPoint, leak("leak13", 0, H13)))
        .and_then(|b| b.with(Rule::LeftPoint, leak("leak23", 1, H23)));
    Arc::new(basis.unwrap())
}

type Places = &'static [(&'static str, &'static str, f64)];

/// Couplings are shared by the two equations of the tanks that they join.
pub fn joint(basis: &Basis) -> Structure {
    let rows: [(&str, Places); 9] = [
        ("eps1", &[("h1", "sine", 1.0)]),
        ("eps2", &[("h2", "sine", -1.0)]),
        ("eps3", &[("h3", "sine", 1.0)]),
        ("c12", &[("h1", "flow12", -1.0), ("h2", "flow12", 1.0)]),
        ("c13", &[("h1", "flow13", -1.0), ("h3", "flow13", 1.0)]),
        ("c23", &[("h2", "flow32", 1.0), ("h3", "flow32", -1.0)]),
        ("L12", &[("h1", "leak12", -1.0)]),
        ("L13", &[("h1", "leak13", -1.0)]),
        ("L23", &[("h2", "leak23", -1.0)]),
    ];
    let empty = Structure::new(basis, &NAMES).and_then(|s| s.known("h1", "inflow", 1.0));
    rows.iter().fold(empty, |s, (name, places)| s.and_then(|s| s.with(name, places))).unwrap()
}
