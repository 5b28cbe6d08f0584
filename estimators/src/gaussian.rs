//! A Gaussian over the transformed parameters: what a prior is and what an estimator returns.
//!
//! Deliberately only a mean and a covariance; the particles carry factors of their own.
//! Read next: `exchange.rs`, which changes the prior under a posterior.

use nalgebra::{DMatrix, DVector};

use crate::spectral;

/// Mean and covariance of p transformed parameters.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Gaussian {
    /// Mean, length p.
    pub mean: DVector<f64>,
    /// Covariance, p x p, symmetric.
    pub covariance: DMatrix<f64>,
}

impl Gaussian {
    /// Independent parameters: mean and standard deviation of each.
    pub fn independent(mean: &[f64], sd: &[f64]) -> Self {
        let variance = DVector::from_iterator(sd.len(), sd.iter().map(|s| s * s));
        Self { mean: DVector::from_column_slice(mean), covariance: DMatrix::from_diagonal(&variance) }
    }

    /// Number of parameters p.
    pub fn n_param(&self) -> usize {
        self.mean.len()
    }

    /// Standard deviations, length p.
    pub fn sd(&self) -> DVector<f64> {
        self.covariance.diagonal().map(|v| v.max(0.0).sqrt())
    }

    /// A factor L with L L^T = covariance: lower Cholesky, or the symmetric root where the covariance is singular.
    ///
    /// # Panics
    /// When the covariance has no eigenvalues, because an entry is no finite number.
    pub fn factor(&self) -> DMatrix<f64> {
        if let Some(cholesky) = self.covariance.clone().cholesky() {
            return cholesky.l();
        }
        let eigen = match spectral::eigen(self.covariance.clone(), "covariance") {
            Ok(eigen) => eigen,
            Err(error) => panic!("a Gaussian has a covariance of finite numbers: {error}"),
        };
        let root = DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()));
        &eigen.eigenvectors * root * eigen.eigenvectors.transpose()
    }
}
