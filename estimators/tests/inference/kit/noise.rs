//! Recordings of noise of any size, and what is said of their noise.

use std::sync::Arc;

use starlings_estimators::inference::{
    Basis, Diffusion, Fit, Pairs, Polynomial, Posterior, Rule, Structure, Varying, varying,
};

use super::sde::{gauss, record, rng};
use super::{sums, times};

/// Step of the recordings.
pub const H: f64 = 0.02;
/// Rate of false alarms that is asked for.
pub const RATE: f64 = 1e-3;

/// Pairs of a recording in blocks of 256 steps.
pub fn pairs<const N: usize>(rows: &[[f64; N]], h: f64) -> Pairs {
    pairs_of(rows, h, |_| 256)
}

/// Pairs of a recording in blocks of as many steps as there are to be from each row on.
pub fn pairs_of<const N: usize>(rows: &[[f64; N]], h: f64, n_step: impl Fn(usize) -> usize) -> Pairs {
    let times = times(rows.len(), h);
    let (mut all, mut to) = (Pairs::new(N), 0);
    while to + 1 < rows.len() {
        let from = to;
        to = (from + n_step(from)).min(rows.len() - 1);
        let block =
            Pairs::of_block(&times[from..=to], rows[from..=to].as_flattened(), N, to - from, usize::MAX);
        all.merge(&block).unwrap();
    }
    all
}

/// Rows of dx = drift dt + size dW (Itô) in steps of h, each of twenty by Euler's rule; both are of the time and of x.
pub fn path(
    seed: u64,
    n: usize,
    drift: impl Fn(f64, f64) -> f64,
    size: impl Fn(f64, f64) -> f64,
) -> Vec<[f64; 1]> {
    let mut draw = rng(seed);
    record(n, (H, 20), [1.0], |t, h, [x]| [x + h * drift(t, *x) + size(t, *x) * h.sqrt() * gauss(&mut draw)])
}

pub fn polynomial(degree: u32, constant: bool) -> Arc<Basis> {
    let family = Polynomial::new(&["x"], 1, &[0], degree, constant);
    Arc::new(Basis::new(1, 0).with(Rule::MidPoint, family).unwrap())
}

/// A fit of constant noise with what it says of others.
pub struct Asked {
    pub constant: Posterior,
    pub robust: Posterior,
    pub told: Vec<Varying>,
}

pub fn asked<const N: usize>(basis: &Arc<Basis>, structure: &Structure, rows: &[[f64; N]], h: f64) -> Asked {
    let fit = Fit::new(Diffusion::Diagonal, structure.n_coefficient());
    let constant = fit.posterior(&sums(basis, rows, h), structure).unwrap();
    let pairs = pairs(rows, h);
    let told = varying(&pairs, basis, constant.drift(), h, RATE).unwrap();
    let robust = fit.robust(&constant, &pairs, (basis, structure), h).unwrap();
    Asked { constant, robust, told }
}

pub fn line() -> (Arc<Basis>, Structure) {
    let basis = polynomial(1, true);
    let structure = Structure::same(&basis, &["x"]).unwrap();
    (basis, structure)
}
