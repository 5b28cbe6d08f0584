//! What is known of the coefficients before the data: a Gaussian as a precision, so that it may say nothing of some of them.
//!
//! Read next: `fit.rs`.

use nalgebra::{DMatrix, DVector};

use super::InferenceError;

/// A Gaussian over P coefficients; a direction without precision is left to the data.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Prior {
    /// Mean, length P.
    #[serde(with = "super::text::vector")]
    pub(crate) mean: DVector<f64>,
    /// Precision, P x P.
    #[serde(with = "super::text::matrix")]
    pub(crate) precision: DMatrix<f64>,
}

impl Prior {
    /// A prior that says nothing.
    pub fn flat(n_coefficient: usize) -> Self {
        Self { mean: DVector::zeros(n_coefficient), precision: DMatrix::zeros(n_coefficient, n_coefficient) }
    }

    /// Independent coefficients: mean and standard deviation of each, an infinite one where nothing is known.
    ///
    /// # Errors
    /// `Shape`, `NotPositive` for a standard deviation, `Overflow` for a mean that is not finite.
    pub fn independent(mean: &[f64], sd: &[f64]) -> Result<Self, InferenceError> {
        if mean.len() != sd.len() {
            let (expected, got) = (mean.len(), sd.len());
            return Err(InferenceError::Shape { what: "standard deviations of a prior", expected, got });
        }
        if let Some(&value) = sd.iter().find(|sd| sd.is_nan() || **sd <= 0.0) {
            return Err(InferenceError::NotPositive { what: "a standard deviation of the prior", value });
        }
        let precision = DVector::from_iterator(sd.len(), sd.iter().map(|sd| 1.0 / (sd * sd)));
        Self::with_precision(DVector::from_column_slice(mean), DMatrix::from_diagonal(&precision))
    }

    /// A mean and a precision, symmetric and without negative directions.
    ///
    /// # Errors
    /// `Shape`, `Overflow`, `NotDefinite`.
    pub fn with_precision(mean: DVector<f64>, precision: DMatrix<f64>) -> Result<Self, InferenceError> {
        let n = mean.len();
        if precision.shape() != (n, n) {
            return Err(InferenceError::Shape {
                what: "rows of the prior's precision",
                expected: n,
                got: precision.nrows(),
            });
        }
        if !mean.iter().chain(&precision).all(|v| v.is_finite()) {
            return Err(InferenceError::Overflow { what: "the prior" });
        }
        let size = precision.diagonal().amax();
        let lifted = &precision + DMatrix::identity(n, n) * (1e-12 * size + f64::MIN_POSITIVE);
        let even = (&precision - precision.transpose()).amax() <= 1e-12 * size;
        if !even || (size > 0.0 && lifted.cholesky().is_none()) {
            return Err(InferenceError::NotDefinite { what: "the prior's precision" });
        }
        Ok(Self { mean, precision })
    }

    /// Number of coefficients P.
    pub fn n_coefficient(&self) -> usize {
        self.mean.len()
    }

    /// Mean, length P.
    pub fn mean(&self) -> &DVector<f64> {
        &self.mean
    }

    /// Precision, P x P.
    pub fn precision(&self) -> &DMatrix<f64> {
        &self.precision
    }

    /// A prior of these coefficients alone.
    pub(crate) fn only(&self, coefficients: &[usize]) -> Self {
        let (mean, precision) = self.select(coefficients);
        Self { mean, precision }
    }

    /// The part of these coefficients.
    pub(crate) fn select(&self, active: &[usize]) -> (DVector<f64>, DMatrix<f64>) {
        (self.mean.select_rows(active), self.precision.select_rows(active).select_columns(active))
    }
}
