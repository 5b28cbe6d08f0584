//! Residuals of the steps of pairs, with the functions there and their slopes: one step at a time.
//!
//! Read next: `varying.rs` and `robust.rs`, which ask for them.

use nalgebra::DMatrix;

use super::pairs::{Pair, Pairs};
use super::{Basis, InferenceError};

/// Residuals r = ẋ − C φ.
pub(crate) struct Residuals<'a> {
    basis: &'a Basis,
    drift: &'a DMatrix<f64>,
    step: f64,
    mid: Vec<f64>,
    functions: Vec<f64>,
    slopes: Vec<f64>,
    residual: Vec<f64>,
}

impl<'a> Residuals<'a> {
    /// Of pairs of this basis, at C of L x B.
    ///
    /// # Errors
    /// `Incompatible`.
    pub(crate) fn new(
        pairs: &Pairs,
        basis: &'a Basis,
        drift: &'a DMatrix<f64>,
        step: f64,
    ) -> Result<Self, InferenceError> {
        let (n, b, l) = (basis.n_channel(), basis.n_function(), basis.n_state());
        if pairs.n_channel() != n || drift.shape() != (l, b) {
            return Err(InferenceError::Incompatible { what: "their channels or functions" });
        }
        let zeros = |n| vec![0.0; n];
        let (functions, slopes, residual) = (zeros(b), zeros(b * l), zeros(l));
        Ok(Self { basis, drift, step, mid: zeros(n), functions, slopes, residual })
    }

    /// Of a pair's first (0) or second (1) step, length L.
    pub(crate) fn of(&mut self, pair: &Pair<'_>, second: usize) -> &[f64] {
        let (left, right) = (pair.row(second), pair.row(second + 1));
        for (mid, (a, b)) in self.mid.iter_mut().zip(left.iter().zip(right)) {
            *mid = 0.5 * (a + b);
        }
        let time = pair.time + second as f64 * self.step;
        self.basis.step_values([time, time + 0.5 * self.step], [left, &self.mid], &mut self.functions);
        for (l, residual) in self.residual.iter_mut().enumerate() {
            let drift: f64 = self.drift.row(l).iter().zip(&self.functions).map(|(c, phi)| c * phi).sum();
            *residual = (right[l] - left[l]) / self.step - drift;
        }
        &self.residual
    }

    /// φ of the step that was asked for last, length B.
    pub(crate) fn functions(&self) -> &[f64] {
        &self.functions
    }

    /// Slopes of that step, `slopes[b * L + l]`.
    pub(crate) fn slopes(&mut self, pair: &Pair<'_>, second: usize) -> &[f64] {
        let time = pair.time + (second as f64 + 0.5) * self.step;
        self.basis.step_slopes(time, &self.mid, &mut self.slopes);
        &self.slopes
    }
}

/// How many times as large as under constant noise the sampling error of each equation's residuals at lag one is, length L, at least once:
/// the root of E r_n² r_{n+1}² over E r².
///
/// # Errors
/// `Incompatible` pairs of another basis.
pub fn lag_spread(
    pairs: &Pairs,
    basis: &Basis,
    drift: &DMatrix<f64>,
    step: f64,
) -> Result<Vec<f64>, InferenceError> {
    let mut residuals = Residuals::new(pairs, basis, drift, step)?;
    let mut sums = vec![[0.0; 2]; basis.n_state()];
    for pair in pairs.iter() {
        let first = residuals.of(&pair, 0).to_vec();
        for ([squares, products], (a, b)) in sums.iter_mut().zip(first.iter().zip(residuals.of(&pair, 1))) {
            *squares += pair.weight * 0.5 * (a * a + b * b);
            *products += pair.weight * (a * b).powi(2);
        }
    }
    let n: f64 = pairs.iter().map(|pair| pair.weight).sum();
    let spread = |[squares, products]: &[f64; 2]| (n * products).sqrt() / squares;
    Ok(sums.iter().map(|sums| spread(sums).max(1.0)).collect())
}
