//! Three-element Windkessel driven by half a sine of flow: the pressure pi behind R_p follows
//! C pi' = Q - pi/R_d, exactly for the mean flow of each step; observed is pi + R_p Q every ten steps, 10 beats.
#![allow(dead_code, missing_docs, unreachable_pub)]

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::Gaussian;

pub const MM_HG: f64 = 1333.22;
pub const DT: f64 = 1e-3;
pub const EVERY: usize = 10;
pub const N_STEP: usize = 8000;
pub const TRUTH: [f64; 3] = [150.0, 1850.0, 1e-3];

pub fn flow(step: usize) -> f64 {
    let phase = (step as f64 * DT).rem_euclid(0.8);
    if phase < 0.3 { 300.0 * (PI * phase / 0.3).sin() } else { 0.0 }
}

/// Advances pi over one step.
pub fn advance(pi: f64, r_d: f64, c: f64, step: usize) -> f64 {
    let e = (-DT / (r_d * c)).exp();
    e * pi + (1.0 - e) * r_d * 0.5 * (flow(step) + flow(step + 1))
}

/// Pressures every ten steps for log R_p, log R_d, log C and pi(0).
pub fn pressure(theta: &[f64]) -> Vec<f64> {
    let [r_p, r_d, c] = [theta[0].exp(), theta[1].exp(), theta[2].exp()];
    let mut pi = theta[3];
    (0..=N_STEP)
        .filter_map(|k| {
            let observed = (k % EVERY == 0).then(|| pi + r_p * flow(k));
            pi = advance(pi, r_d, c, k);
            observed
        })
        .collect()
}

/// pi(0) of the periodic solution.
pub fn periodic() -> f64 {
    let [_, r_d, c] = TRUTH;
    let driven = (0..800).fold(0.0, |pi, k| advance(pi, r_d, c, k));
    driven / (1.0 - (-0.8 / (r_d * c)).exp())
}

pub fn truth() -> Vec<f64> {
    TRUTH.iter().map(|v| v.ln()).chain([periodic()]).collect()
}

/// Prior 300, 1200, 2e-3 with sd `sd` in log, pi(0) 60 +- 30 mmHg.
pub fn prior(sd: f64) -> Gaussian {
    let mean = [300f64.ln(), 1200f64.ln(), 2e-3f64.ln(), 60.0 * MM_HG];
    Gaussian::independent(&mean, &[sd, sd, sd, 30.0 * MM_HG])
}

/// States of all particles, 1 x r, advanced from analysis k - 1 to analysis k.
pub fn forecast(pi: &mut DMatrix<f64>, theta: &DMatrix<f64>, k: usize) {
    for (pi, particle) in pi.iter_mut().zip(theta.column_iter()) {
        let (r_d, c) = (particle[1].exp(), particle[2].exp());
        *pi = ((k - 1) * EVERY..k * EVERY).fold(*pi, |pi, step| advance(pi, r_d, c, step));
    }
}

/// Predicted pressure of every particle at analysis k, 1 x r.
pub fn predict(pi: &DMatrix<f64>, theta: &DMatrix<f64>, k: usize) -> DMatrix<f64> {
    DMatrix::from_fn(1, pi.ncols(), |_, i| pi[i] + theta[(0, i)].exp() * flow(k * EVERY))
}

pub fn physical(mean: &DVector<f64>) -> [f64; 3] {
    [mean[0].exp(), mean[1].exp(), mean[2].exp()]
}
