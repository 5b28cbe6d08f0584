//! Sums of products of residuals of a drift whose coefficients are uncertain: what the noise is told from, and what is told of it.
//!
//! Read next: `fit.rs`, `noise_check.rs` and `noise_form.rs`, which ask.

use nalgebra::DMatrix;

use super::{Posterior, Structure, Sums};

/// A drift, L x B, with the covariance of those of its coefficients that have a value, A x A, beside the sums that it was found from.
pub(crate) struct ResidualProducts<'a> {
    pub(crate) sums: &'a Sums,
    pub(crate) structure: &'a Structure,
    pub(crate) drift: &'a DMatrix<f64>,
    pub(crate) active: &'a [usize],
    pub(crate) covariance: &'a DMatrix<f64>,
}

impl<'a> ResidualProducts<'a> {
    /// Those of a posterior.
    pub(crate) fn of(sums: &'a Sums, structure: &'a Structure, posterior: &'a Posterior) -> Self {
        let Posterior { drift, active, covariance, .. } = posterior;
        Self { sums, structure, drift, active, covariance }
    }

    /// Σ r_n r_nᵀ, L x L, with what the uncertainty of the coefficients adds.
    pub(crate) fn squares(&self) -> DMatrix<f64> {
        self.sums.residuals(self.drift) + self.spread(&self.sums.phi())
    }

    /// The same of neighbouring steps, Σ r_n r_{n+1}ᵀ.
    pub(crate) fn lagged(&self) -> DMatrix<f64> {
        self.sums.lagged_residuals(self.drift) + self.spread(&self.sums.lagged_phi())
    }

    /// The sum that the noise is told from, N D/h: of squares, or of these and of neighbouring steps, which errors of the measurement leave
    /// right (`diffusion.rs`).
    pub(crate) fn of_noise(&self, lag_corrected: bool) -> DMatrix<f64> {
        let mut products = self.squares();
        if lag_corrected && self.sums.n_pair() > 0 {
            let lagged = self.lagged();
            let share = self.sums.n_step() as f64 / self.sums.n_pair() as f64;
            products += (&lagged + lagged.transpose()) * share;
        }
        products
    }

    /// Σ F_n cov F_mᵀ, L x L, for Σ φ_n φ_mᵀ of B x B: what the uncertainty of the coefficients adds to residuals.
    fn spread(&self, phi: &DMatrix<f64>) -> DMatrix<f64> {
        let Self { structure, active, covariance, .. } = self;
        let n = structure.equations().len();
        let mut spread = DMatrix::zeros(n, n);
        for (i, p) in active.iter().enumerate() {
            for (j, q) in active.iter().enumerate() {
                for a in &structure.coefficients()[*p].places {
                    for b in &structure.coefficients()[*q].places {
                        spread[(a.equation, b.equation)] +=
                            covariance[(i, j)] * a.factor * b.factor * phi[(a.function, b.function)];
                    }
                }
            }
        }
        spread
    }
}
