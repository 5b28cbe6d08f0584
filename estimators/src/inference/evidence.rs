//! The evidence for a structure: how probable the recording is before the coefficients are known.
//!
//! At the noise D the likelihood is Gaussian in the coefficients, so the integral over them is exact: ln p = −S(c) − ½ (c − c₀)ᵀ Ξ₀
//! (c − c₀) + ½ ln |Ξ₀| − ½ ln |Ξ| at the posterior mean, with S of eq. 1.6 of Smelyanskiy, Luchinsky et al. (NL/2 instead of NL
//! before ln 2πh). Compare structures at one D, that of the richest. Read next: `reduced.rs`, which tests a nonlinear restriction.

use nalgebra::{DMatrix, DVector};

use super::{Diffusion, Fit, InferenceError, Posterior, Structure, Sums};

impl Fit {
    /// ln p(x₁ … x_N | x₀, D) in nats; `None` where the prior says nothing of a coefficient that the posterior holds.
    ///
    /// # Errors
    /// As for [`Fit::posterior`]; `Shape` where D was not given.
    pub fn log_evidence(&self, sums: &Sums, structure: &Structure) -> Result<Option<f64>, InferenceError> {
        let Diffusion::Known(noise) = &self.diffusion else {
            return Err(InferenceError::Shape { what: "given diffusions", expected: 1, got: 0 });
        };
        let posterior = self.posterior(sums, structure)?;
        let (mean, prior) = self.prior.select(&posterior.active);
        let Some(log_prior) = log_det(&prior) else { return Ok(None) };
        let overflow = InferenceError::Overflow { what: "the evidence" };
        let log_posterior = log_det(&posterior.precision).ok_or(overflow.clone())?;
        let action = self.action(sums, &posterior, noise).ok_or(overflow.clone())?;
        let away: DVector<f64> = &posterior.mean - mean;
        let log = -action - 0.5 * away.dot(&(prior * &away)) + 0.5 * (log_prior - log_posterior);
        if log.is_finite() { Ok(Some(log)) } else { Err(overflow) }
    }

    /// ln of the likelihood, in nats, of a recording that the posterior does not come from, at its means and its noise; `None` where
    /// the recording has no steps or the number is not finite.
    ///
    /// # Errors
    /// `Shape` where the sums are of other functions or equations.
    pub fn log_likelihood(&self, sums: &Sums, posterior: &Posterior) -> Result<Option<f64>, InferenceError> {
        let (expected, got) = (posterior.drift.shape(), (sums.n_state(), sums.n_function()));
        if expected != got {
            return Err(InferenceError::Shape {
                what: "functions of the sums",
                expected: expected.1,
                got: got.1,
            });
        }
        let action = self.action(sums, posterior, &posterior.diffusion).filter(|_| sums.n_step() > 0);
        Ok(action.map(|action| -action).filter(|log| log.is_finite()))
    }

    /// S_dyn at the posterior mean.
    pub(crate) fn action(&self, sums: &Sums, posterior: &Posterior, noise: &DMatrix<f64>) -> Option<f64> {
        let (n, l, h) = (sums.n_step() as f64, sums.n_state() as f64, sums.step());
        let root = noise.clone().cholesky()?;
        let squares = root.solve(&sums.residuals(&posterior.drift)).trace();
        let divergence = if self.prefactor { posterior.drift.component_mul(sums.v()).sum() } else { 0.0 };
        let constant = 0.5 * n * (log_det(noise)? + l * (std::f64::consts::TAU * h).ln());
        Some(constant + 0.5 * h * (divergence + squares))
    }
}

/// ln |A| of a positive definite matrix.
fn log_det(matrix: &DMatrix<f64>) -> Option<f64> {
    let root = matrix.clone().cholesky()?;
    Some(2.0 * root.l_dirty().diagonal().map(f64::ln).sum())
}
