//! Can these data determine these parameters? Answered from the sensitivities alone, before anything is estimated.
//!
//! The sensitivities S are the derivatives of the predictions by the transformed parameters, divided by the noise sd of
//! their rows; F = S^T S is the Fisher information. Everything is local: it holds where the sensitivities were taken, and
//! for a model that is close to linear within the result. Directions are compared in units of the prior sd, so that a
//! flow and a stiffness can stand in one combination. Observed values, names and thresholds for warnings are not used here.
//! Read next: `identifiability/fisher.rs`, then `collinearity.rs` and `generalised.rs` beside it.

mod collinearity;
mod direction;
mod fisher;
mod generalised;
mod slopes;

pub use collinearity::{Collinearity, Subset};
pub use direction::{Direction, weak_directions};
pub use fisher::Fisher;
pub use slopes::sigma_point_sensitivities;

use nalgebra::DMatrix;

use crate::EstimatorError;
use crate::data::same;

/// A column shorter than this, in noise sd per prior sd, counts as no response: rounding of the predictions can be as large.
const SILENT: f64 = 1e-6;

/// Whitened sensitivities of an experiment, rows without an observation left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivities {
    /// Derivatives by the parameters in prior sd, in noise sd: n_used x p.
    scaled: DMatrix<f64>,
    /// The rows that were kept, of those given.
    rows: Vec<usize>,
    /// Prior sd of each parameter, transformed units.
    prior_sd: Vec<f64>,
    /// Relative accuracy of a column.
    accuracy: f64,
}

impl Sensitivities {
    /// From d prediction / d theta over the noise sd, m x p in transformed units; a row that holds a NaN is left out.
    ///
    /// `accuracy` is the relative error of a column: a combination of columns that is smaller than this error passes for
    /// zero. About 1e-12 for exact derivatives, the square of the distance of the points in prior sd for differences.
    ///
    /// # Errors
    /// `NoParameters`; `Shape` when the prior sds do not fit the columns; `NotFinite` for an infinite sensitivity or a
    /// prior sd that is not positive and finite.
    pub fn new(whitened: &DMatrix<f64>, prior_sd: &[f64], accuracy: f64) -> Result<Self, EstimatorError> {
        let p = whitened.ncols();
        if p == 0 {
            return Err(EstimatorError::NoParameters);
        }
        same("prior standard deviations", p, prior_sd.len())?;
        if !prior_sd.iter().all(|sd| *sd > 0.0 && sd.is_finite()) {
            return Err(EstimatorError::NotFinite { what: "a prior standard deviation" });
        }
        let known = |row: &usize| !whitened.row(*row).iter().any(|v| v.is_nan());
        let rows: Vec<usize> = (0..whitened.nrows()).filter(known).collect();
        let scaled = DMatrix::from_fn(rows.len(), p, |i, j| whitened[(rows[i], j)] * prior_sd[j]);
        if !scaled.norm_squared().is_finite() {
            return Err(EstimatorError::NotFinite { what: "the square of a sensitivity" });
        }
        Ok(Self { scaled, rows, prior_sd: prior_sd.to_vec(), accuracy: accuracy.abs() })
    }

    /// Number of parameters p.
    pub fn n_param(&self) -> usize {
        self.prior_sd.len()
    }

    /// Number of rows that were not missing.
    pub fn n_used(&self) -> usize {
        self.rows.len()
    }

    /// Length of each column: root of the summed squares in noise sd, per transformed unit.
    pub fn norms(&self) -> Vec<f64> {
        self.scaled.column_iter().zip(&self.prior_sd).map(|(column, sd)| column.norm() / sd).collect()
    }

    /// Parameters (from 0) that change no observed prediction.
    pub fn silent(&self) -> Vec<usize> {
        (0..self.n_param()).filter(|j| self.scaled.column(*j).norm() < SILENT).collect()
    }

    /// The Fisher information and what follows from it.
    ///
    /// # Errors
    /// `NotFinite` when the singular values cannot be found.
    pub fn fisher(&self) -> Result<Fisher, EstimatorError> {
        Fisher::new(&self.scaled, &self.prior_sd, self.accuracy)
    }

    /// Near linear dependence of the columns.
    pub fn collinearity(&self) -> Collinearity {
        Collinearity::new(&self.scaled, &self.silent(), self.accuracy)
    }

    /// Generalised sensitivity functions (Thomaseth & Cobelli 1999), one per parameter:
    /// GS(t_k) = sum over i <= k of diag(F^{-1} s_i s_i^T).
    ///
    /// `step` numbers the times of the rows given to [`Sensitivities::new`], from 0 and not decreasing: rows of one time
    /// are taken together. Each function has one value per step and ends at one; `None` for a parameter that takes part
    /// in a direction without information, whose inverse does not exist.
    ///
    /// # Errors
    /// `Shape` when a row has no step.
    pub fn generalised(
        &self,
        fisher: &Fisher,
        step: &[usize],
    ) -> Result<Vec<Option<Vec<f64>>>, EstimatorError> {
        let needed = self.rows.last().map_or(0, |row| row + 1);
        if step.len() < needed {
            return Err(EstimatorError::Shape {
                what: "steps of the rows",
                expected: needed,
                got: step.len(),
            });
        }
        let n_step = step.last().map_or(0, |last| last + 1);
        let of_rows: Vec<usize> = self.rows.iter().map(|row| step[*row]).collect();
        Ok(generalised::cumulated(&self.scaled, fisher, &of_rows, n_step))
    }
}
