//! What an inference returns: coefficients and noise, with their uncertainty.
//!
//! A coefficient of which the data say nothing is "not observed", never zero: it has no value unless a prior gives one.
//! Read next: `fit.rs`, which makes it.

use nalgebra::{DMatrix, DVector};

use super::{InferenceError, Prior, Structure};
use crate::quantiles::{chi_squared, student};

/// Value and uncertainty of one coefficient.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// Posterior mean.
    pub mean: f64,
    /// Posterior standard deviation.
    pub sd: f64,
}

/// One coefficient after the data.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Its name.
    pub name: String,
    /// Whether the data say anything of it.
    pub observed: bool,
    /// Its value, `None` where neither data nor prior say anything.
    pub value: Option<Value>,
}

/// The posterior of a fit.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Posterior {
    /// The P coefficients.
    pub estimates: Vec<Estimate>,
    /// D, L x L, per time unit.
    #[serde(with = "super::text::matrix")]
    pub diffusion: DMatrix<f64>,
    /// Degrees of freedom left for each variance in D, were all residuals independent; `None` where D was given.
    pub degrees: Option<f64>,
    /// The share of them that each variance has where D was taken from lagged residuals, length L; empty elsewhere.
    #[serde(default)]
    pub(crate) shares: Vec<f64>,
    /// Number of steps N.
    pub n_step: u64,
    /// Passes until coefficients and noise settled.
    pub passes: usize,
    /// Indices of the coefficients that have a value.
    pub(crate) active: Vec<usize>,
    #[serde(with = "super::text::vector")]
    pub(crate) mean: DVector<f64>,
    #[serde(with = "super::text::matrix")]
    pub(crate) covariance: DMatrix<f64>,
    #[serde(with = "super::text::matrix")]
    pub(crate) precision: DMatrix<f64>,
    #[serde(with = "super::text::matrix")]
    pub(crate) drift: DMatrix<f64>,
}

impl Posterior {
    /// Indices of the coefficients that have a value, length A.
    pub fn active(&self) -> &[usize] {
        &self.active
    }

    /// Means of the coefficients that have a value, length A.
    pub fn mean(&self) -> &DVector<f64> {
        &self.mean
    }

    /// Covariance of the coefficients that have a value, A x A.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// Precision of the coefficients that have a value, A x A, the prior's included.
    pub fn precision(&self) -> &DMatrix<f64> {
        &self.precision
    }

    /// C, L x B, known terms included. A coefficient without a value counts as absent: its functions were zero on all data.
    pub fn drift(&self) -> &DMatrix<f64> {
        &self.drift
    }

    /// The value of the coefficient of this name.
    pub fn value(&self, name: &str) -> Option<Value> {
        self.estimates.iter().find(|e| e.name == name)?.value
    }

    /// Degrees of freedom of the variance of an equation's noise; `None` where D was given.
    pub fn degrees_of(&self, equation: usize) -> Option<f64> {
        let share = self.shares.get(equation).copied().unwrap_or(1.0);
        // A variance of which nothing is left has a value yet, of as little weight as one residual's.
        self.degrees.map(|degrees| (degrees * share).max(degrees.min(1.0)))
    }

    /// The least of them over the equations.
    pub fn least_degrees(&self) -> Option<f64> {
        let all = (0..self.diffusion.nrows()).filter_map(|l| self.degrees_of(l));
        self.degrees.map(|degrees| all.fold(degrees, f64::min))
    }

    /// The interval that holds a coefficient with probability `level`, by Student's t.
    pub fn interval(&self, coefficient: usize, level: f64) -> Option<[f64; 2]> {
        let Value { mean, sd } = self.estimates.get(coefficient)?.value?;
        let half = student(0.5 * (1.0 + level), self.least_degrees()) * sd;
        Some([mean - half, mean + half])
    }

    /// Whether the interval of a coefficient holds zero; `None` where it has no value.
    pub fn may_be_zero(&self, coefficient: usize, level: f64) -> Option<bool> {
        self.interval(coefficient, level).map(|[lo, hi]| lo <= 0.0 && hi >= 0.0)
    }

    /// Standard deviations of the entries of D, L x L, of its inverse Wishart posterior: sd(D_ii) = D_ii sqrt(2/ν), with the ν of each
    /// equation. Zero where D was given.
    pub fn diffusion_sd(&self) -> DMatrix<f64> {
        let d = &self.diffusion;
        DMatrix::from_fn(d.nrows(), d.ncols(), |i, j| {
            let variance = d[(i, i)] * d[(j, j)] + d[(i, j)] * d[(i, j)];
            let degrees = self.degrees_of(i).zip(self.degrees_of(j));
            degrees.map_or(0.0, |(of_i, of_j)| (variance / (of_i * of_j).sqrt()).sqrt())
        })
    }

    /// The interval that holds D_ii with probability `level`; `None` where D was given.
    pub fn diffusion_interval(&self, equation: usize, level: f64) -> Option<[f64; 2]> {
        let degrees = self.degrees_of(equation)?;
        let d = self.diffusion[(equation, equation)] * degrees;
        let at = |p| d / chi_squared(p, degrees);
        Some([at(0.5 * (1.0 + level)), at(0.5 * (1.0 - level))])
    }

    /// This posterior as the prior of later data (eq. 1.23, with Ξ c instead of Ξ⁻¹ c).
    pub fn as_prior(&self) -> Prior {
        let n = self.estimates.len();
        let mut prior = Prior::flat(n);
        for (i, p) in self.active.iter().enumerate() {
            prior.mean[*p] = self.mean[i];
            for (j, q) in self.active.iter().enumerate() {
                prior.precision[(*p, *q)] = self.precision[(i, j)];
            }
        }
        prior
    }

    /// Whether this posterior, which came from elsewhere, is whole and of this structure.
    ///
    /// # Errors
    /// `Incompatible` with the structure, `Damaged` otherwise.
    pub fn check(&self, structure: &Structure) -> Result<(), InferenceError> {
        let names = self.estimates.iter().map(|e| &e.name);
        if !names.eq(structure.coefficients().iter().map(|c| &c.name)) {
            return Err(InferenceError::Incompatible { what: "their coefficients" });
        }
        let (a, l, b) = (self.active.len(), structure.equations().len(), structure.n_function());
        let increasing = self.active.windows(2).all(|pair| pair[0] < pair[1]);
        let shapes = self.mean.len() == a
            && self.covariance.shape() == (a, a)
            && self.precision.shape() == (a, a)
            && self.diffusion.shape() == (l, l)
            && self.drift.shape() == (l, b)
            && (self.shares.is_empty() || self.shares.len() == l);
        if !increasing || self.active.last().is_some_and(|p| *p >= self.estimates.len()) || !shapes {
            return Err(InferenceError::Damaged { what: "a part of the posterior of another shape" });
        }
        let parts = [&self.covariance, &self.precision, &self.diffusion, &self.drift];
        let mut numbers =
            parts.into_iter().flatten().chain(&self.mean).chain(&self.degrees).chain(&self.shares);
        if !numbers.all(|v| v.is_finite()) {
            return Err(InferenceError::Damaged { what: "a number of the posterior that is not finite" });
        }
        Ok(())
    }

    /// Estimates from the parts of a fit.
    pub(crate) fn estimates(
        structure: &Structure,
        active: &[usize],
        observed: &[usize],
        mean: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let one = |(p, coefficient): (usize, &super::Coefficient)| {
            let at = active.iter().position(|a| *a == p);
            let value = at.map(|i| Value { mean: mean[i], sd: covariance[(i, i)].sqrt() });
            Estimate { name: coefficient.name.clone(), observed: observed.contains(&p), value }
        };
        structure.coefficients().iter().enumerate().map(one).collect()
    }
}
