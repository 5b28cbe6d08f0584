//! Draws from a posterior of coefficients and noise, for ensembles of what may happen next.
//!
//! Coefficients are drawn from a multivariate Student distribution with the degrees of freedom of the noise, the noise from its inverse
//! Wishart posterior by Bartlett's decomposition (Smith and Hocking 1972, "Algorithm AS 53"), so that every coefficient and every
//! variance by itself has the interval of its table. Their dependence on one another, which is of the order of one over those degrees, is
//! left out. Read next: `posterior.rs`.

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

use super::{Diffusion, InferenceError};
use crate::Gaussian;

/// What is drawn from.
#[derive(Debug, Clone)]
pub struct Draws {
    mean: DVector<f64>,
    root: DMatrix<f64>,
    /// Lower root of D.
    noise: DMatrix<f64>,
    form: Diffusion,
    degrees: Option<f64>,
}

/// One draw.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// Coefficients, in the order of the posterior's mean.
    pub coefficients: DVector<f64>,
    /// Lower triangular B with B Bᵀ = D, L x L, per square root of the time unit.
    pub noise: DMatrix<f64>,
}

impl Draws {
    /// Of A coefficients with this posterior, and a noise D of L x L with so many degrees of freedom; `None` where D is known.
    ///
    /// # Errors
    /// `Shape` where mean and covariance do not fit; `NotDefinite` for a covariance that is no matrix of finite numbers, a D that is not
    /// positive definite, or degrees that are not positive.
    pub fn new(
        coefficients: Gaussian,
        diffusion: &DMatrix<f64>,
        degrees: Option<f64>,
        form: Diffusion,
    ) -> Result<Self, InferenceError> {
        let n = coefficients.mean.len();
        if coefficients.covariance.shape() != (n, n) {
            let got = coefficients.covariance.nrows();
            return Err(InferenceError::Shape { what: "rows of the covariance", expected: n, got });
        }
        if !coefficients.mean.iter().chain(&coefficients.covariance).all(|v| v.is_finite()) {
            return Err(InferenceError::NotDefinite { what: "the covariance of the coefficients" });
        }
        let definite = || InferenceError::NotDefinite { what: "the diffusion" };
        if degrees.is_some_and(|degrees| !(degrees > 0.0 && degrees.is_finite())) || !diffusion.is_square() {
            return Err(definite());
        }
        let noise = diffusion.clone().cholesky().ok_or_else(definite)?.l();
        let root = coefficients.factor();
        Ok(Self { mean: coefficients.mean, root, noise, form, degrees })
    }

    /// The next draw.
    pub fn draw(&self, rng: &mut impl Rng) -> Drawn {
        let z = DVector::from_fn(self.root.ncols(), |_, _| StandardNormal.sample(rng));
        let stretch = self.ratio(rng, 0.0).sqrt();
        Drawn { coefficients: &self.mean + &self.root * z * stretch, noise: self.noise(rng) }
    }

    /// ν + `more` over a draw of χ² with so many degrees; one where D is known.
    fn ratio(&self, rng: &mut impl Rng, more: f64) -> f64 {
        let of = |degrees: f64| ChiSquared::new(degrees + more).ok().map(|chi| (degrees, chi));
        self.degrees.and_then(of).map_or(1.0, |(degrees, chi)| degrees / chi.sample(rng))
    }

    fn noise(&self, rng: &mut impl Rng) -> DMatrix<f64> {
        let n = self.noise.nrows();
        match &self.form {
            Diffusion::Known(_) => self.noise.clone(),
            Diffusion::Isotropic => &self.noise * self.ratio(rng, 0.0).sqrt(),
            Diffusion::Diagonal => {
                let factors = DVector::from_fn(n, |_, _| self.ratio(rng, 0.0).sqrt());
                DMatrix::from_diagonal(&factors) * &self.noise
            }
            Diffusion::Full => {
                let Some(degrees) = self.degrees else { return self.noise.clone() };
                // W = A Aᵀ is Wishart of identity; D = ν U W⁻¹ Uᵀ with D̂ = U Uᵀ then has variances of ν D̂_ll/χ²_ν.
                let bartlett = DMatrix::from_fn(n, n, |i, j| match i.cmp(&j) {
                    std::cmp::Ordering::Less => 0.0,
                    std::cmp::Ordering::Equal => {
                        let left = (n - 1 - i) as f64;
                        (degrees / self.ratio(rng, left)).sqrt()
                    }
                    std::cmp::Ordering::Greater => StandardNormal.sample(rng),
                });
                let inverse = bartlett.solve_lower_triangular(&DMatrix::identity(n, n));
                let spread = inverse.map(|inverse| &self.noise * inverse.transpose() * degrees.sqrt());
                let drawn = spread.and_then(|b| (&b * b.transpose()).cholesky());
                drawn.map_or_else(|| self.noise.clone(), |cholesky| cholesky.l())
            }
        }
    }
}
