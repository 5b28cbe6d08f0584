//! The measurement model y = G(x) b + M^{1/2} η: its coefficients b and noise M are those of a regression without time.
//!
//! Θ = Σ Gᵀ M⁻¹ G, b = Θ⁻¹ Σ Gᵀ M⁻¹ y, M = (1/N) Σ rrᵀ less the bias of the fit (Smelyanskiy, Luchinsky et al., eq. 1.16, with
//! Θ as the precision that it is). The equations are those of the drift with h = 1 and without a Jacobian, so the same sums,
//! structures and fit serve: D of the posterior is M. Read next: `fit.rs`.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::sums::BlockSums;
use super::{Basis, Diffusion, Fit, InferenceError, Sums};

/// Samples of outputs y and of what they are measured from, on their way into [`Sums`].
#[derive(Debug)]
pub struct Regression {
    basis: Arc<Basis>,
    row: Vec<f64>,
    products: DMatrix<f64>,
    lagged: DMatrix<f64>,
    slopes: Vec<f64>,
    n: u64,
    sums: Sums,
}

impl Regression {
    /// No sample yet. The states of the basis are the outputs y, its inputs are x; functions read inputs only.
    pub fn new(basis: Arc<Basis>) -> Self {
        let (b, l) = (basis.n_function(), basis.n_state());
        Self {
            row: vec![0.0; b + l],
            products: DMatrix::zeros(b + l, b + l),
            lagged: DMatrix::zeros(b + l, b + l),
            slopes: vec![0.0; b * l],
            n: 0,
            sums: Sums::new(&basis, 1.0),
            basis,
        }
    }

    /// Takes the outputs y and the x that they were measured from.
    ///
    /// # Errors
    /// `Shape`, `NonFinite`.
    pub fn push(&mut self, time: f64, y: &[f64], x: &[f64]) -> Result<(), InferenceError> {
        let (b, l) = (self.basis.n_function(), self.basis.n_state());
        if (y.len(), x.len()) != (l, self.basis.n_channel() - l) {
            let (expected, got) = (self.basis.n_channel(), y.len() + x.len());
            return Err(InferenceError::Shape { what: "outputs and states of a sample", expected, got });
        }
        let sample: Vec<f64> = y.iter().chain(x).copied().collect();
        self.basis.values(time, &sample, &mut self.row[..b]);
        self.row[b..].copy_from_slice(y);
        if let Some(k) = self.row.iter().position(|v| !v.is_finite()) {
            let what = self.basis.names().get(k).cloned().unwrap_or_else(|| format!("output {}", k - b));
            return Err(InferenceError::NonFinite { row: self.n, what, value: self.row[k] });
        }
        for (j, right) in self.row.iter().enumerate() {
            for (i, left) in self.row[..=j].iter().enumerate() {
                self.products[(i, j)] = left * right;
            }
        }
        self.sums.add(&BlockSums {
            n: 1,
            products: &self.products,
            lagged: &self.lagged,
            slopes: &self.slopes,
            times: [self.n as f64; 2],
            rows: [&self.row, &self.row],
            follows: self.n > 0,
        });
        self.n += 1;
        Ok(())
    }

    /// The sums, for [`Regression::fit`].
    pub fn sums(&self) -> &Sums {
        &self.sums
    }

    /// The fit that makes b and M of such sums.
    pub fn fit(noise: Diffusion, n_coefficient: usize) -> Fit {
        Fit { prefactor: false, ..Fit::new(noise, n_coefficient) }
    }
}
