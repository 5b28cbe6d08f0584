//! Small seeded integrators, the systems they run, and a dense version of the estimator to compare with.
#![allow(dead_code)]

pub mod dense;
pub mod fhn;
pub mod lorenz;
pub mod motor;
pub mod neutral;
pub mod noise;
pub mod sde;
pub mod tanks;

use std::sync::Arc;

use starlings_estimators::inference::{Basis, Stream, Sums};

/// A recording: time of every row is its number times h.
pub fn times(n_row: usize, h: f64) -> Vec<f64> {
    (0..n_row).map(|n| n as f64 * h).collect()
}

/// Sums of a recording in one pass.
pub fn sums<const N: usize>(basis: &Arc<Basis>, rows: &[[f64; N]], h: f64) -> Sums {
    let mut stream = Stream::new(Arc::clone(basis), h).unwrap();
    stream.extend(&times(rows.len(), h), rows.as_flattened()).unwrap();
    stream.take().unwrap()
}

pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    quantile(values, 0.5)
}

pub fn quantile(values: impl IntoIterator<Item = f64>, p: f64) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted[(p * (sorted.len() - 1) as f64).round() as usize]
}

pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (n, sum) = values.into_iter().fold((0, 0.0), |(n, sum), v| (n + 1, sum + v));
    sum / f64::from(n)
}

pub fn sd(values: &[f64]) -> f64 {
    let centre = mean(values.iter().copied());
    mean(values.iter().map(|v| (v - centre).powi(2))).sqrt()
}
