//! Forms of the noise and its estimate from residuals.
//!
//! With measurement noise of covariance M the residuals r of neighbouring steps share an error: E rrᵀ = D/h + 2M/h² and
//! E r_n r_{n+1}ᵀ = −M/h², so h (E rrᵀ + E r_n r_{n+1}ᵀ + E r_{n+1} r_nᵀ) is D again. Read next: `fit.rs`.

use nalgebra::DMatrix;

use super::{InferenceError, Structure, Sums};

/// Residual squares relative to those of ẋ below which rounding decides: an equation without noise.
const NOISELESS: f64 = 1e-12;
/// Share of an equation's noise that no other equation's explains, below which their noise is one.
const LEAST_SHARE: f64 = 1e-10;

/// The form of D, the covariance of the noise per time unit.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub enum Diffusion {
    /// Any covariance, L x L.
    Full,
    /// Independent noise of every equation.
    Diagonal,
    /// Independent noise of one size.
    Isotropic,
    /// Given, L x L.
    Known(#[serde(with = "super::text::matrix")] DMatrix<f64>),
}

impl Diffusion {
    /// The first guess: all that the known terms leave is noise.
    pub(crate) fn first(&self, sums: &Sums, structure: &Structure) -> Result<DMatrix<f64>, InferenceError> {
        let n = sums.n_state();
        if let Self::Known(given) = self {
            if given.shape() != (n, n) {
                let got = given.nrows();
                return Err(InferenceError::Shape { what: "rows of the diffusion", expected: n, got });
            }
            let even = (given - given.transpose()).amax() <= 1e-12 * given.amax();
            if !even || !given.iter().all(|v| v.is_finite()) || given.clone().cholesky().is_none() {
                return Err(InferenceError::NotDefinite { what: "the diffusion" });
            }
            return Ok(given.clone());
        }
        if sums.n_step() == 0 {
            let equation = structure.equations().first().cloned().unwrap_or_default();
            return Err(InferenceError::TooFew { n_step: 0, n_unknown: structure.n_coefficient(), equation });
        }
        let known = structure.matrix(&[], &[]);
        noisy(sums, structure, &known)?;
        self.estimate(sums, structure, &sums.residuals(&known))
    }

    /// D from the sum of the products of residuals, L x L.
    pub(crate) fn estimate(
        &self,
        sums: &Sums,
        structure: &Structure,
        products: &DMatrix<f64>,
    ) -> Result<DMatrix<f64>, InferenceError> {
        let mean = mean(sums, products);
        let n = mean.nrows();
        let noise = match self {
            Self::Full | Self::Known(_) => mean,
            Self::Diagonal => DMatrix::from_diagonal(&mean.diagonal()),
            Self::Isotropic => DMatrix::from_diagonal_element(n, n, mean.trace() / n as f64),
        };
        definite(&noise, structure)?;
        Ok(noise)
    }

    /// Degrees of freedom of each variance for `n_active` coefficients.
    pub(crate) fn degrees(&self, sums: &Sums, n_active: usize) -> Option<f64> {
        let per_equation = sums.n_step() as f64 - n_active as f64 / sums.n_state() as f64;
        match self {
            Self::Known(_) => None,
            Self::Full | Self::Diagonal | Self::Isotropic => {
                Some(per_equation * self.n_shared(sums.n_state()))
            }
        }
    }

    /// Equations, of all L, whose residuals tell one variance together.
    pub(crate) fn n_shared(&self, n_state: usize) -> f64 {
        if matches!(self, Self::Isotropic) { n_state as f64 } else { 1.0 }
    }
}

/// The covariance that residuals have per time unit, from the sum of their products, L x L.
pub(crate) fn mean(sums: &Sums, products: &DMatrix<f64>) -> DMatrix<f64> {
    let mean = products * (sums.step() / sums.n_step() as f64);
    (&mean + mean.transpose()) * 0.5
}

/// Whether every equation leaves residuals beyond rounding.
pub(crate) fn noisy(sums: &Sums, structure: &Structure, drift: &DMatrix<f64>) -> Result<(), InferenceError> {
    let squares = sums.residuals(drift);
    let speeds = sums.q().diagonal() + (drift * sums.phi() * drift.transpose()).diagonal();
    if !squares.iter().chain(&speeds).all(|v| v.is_finite()) {
        return Err(InferenceError::Overflow { what: "the squares of the residuals" });
    }
    let noiseless = |l: usize| squares[(l, l)] <= NOISELESS * speeds[l];
    if (0..squares.nrows()).any(noiseless) {
        return Err(indefinite(structure, noiseless));
    }
    Ok(())
}

/// D⁻¹.
pub(crate) fn inverse(noise: &DMatrix<f64>, structure: &Structure) -> Result<DMatrix<f64>, InferenceError> {
    let inverse = noise.clone().cholesky().map(|root| root.inverse());
    let whole = inverse.filter(|inverse| inverse.iter().all(|v| v.is_finite()));
    whole.ok_or_else(|| indefinite(structure, |_| true))
}

/// Whether a covariance is positive definite beyond rounding.
fn definite(noise: &DMatrix<f64>, structure: &Structure) -> Result<(), InferenceError> {
    let negative = |l: usize| noise[(l, l)] <= 0.0;
    if (0..noise.nrows()).any(negative) {
        return Err(indefinite(structure, negative));
    }
    let scale = DMatrix::from_diagonal(&noise.diagonal().map(|v| 1.0 / v.sqrt()));
    let root = (&scale * noise * &scale).cholesky();
    match root {
        Some(root) if root.l_dirty().diagonal().iter().all(|v| v * v > LEAST_SHARE) => Ok(()),
        _ => Err(indefinite(structure, |_| true)),
    }
}

fn indefinite(structure: &Structure, takes_part: impl Fn(usize) -> bool) -> InferenceError {
    let names = structure.equations().iter().enumerate().filter(|(l, _)| takes_part(*l));
    InferenceError::DiffusionNotDefinite { equations: names.map(|(_, name)| name.clone()).collect() }
}
