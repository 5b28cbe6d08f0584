//! The Fisher information by its singular value decomposition, so that no digit is lost where it is nearly singular.
//!
//! With u the parameters in prior sd, S_u = Q diag(s) V^T: the data alone leave the sd 1/s_k in the direction v_k, data
//! and prior together 1/sqrt(1 + s_k^2). A direction whose s_k cannot be told from zero holds no information: it is never
//! inverted, and figures that would need its inverse are `None`.

use nalgebra::{DMatrix, DVector};

use super::direction::{Axis, Direction, named};
use crate::{EstimatorError, spectral};

/// Below this many noise sd per prior sd the data alone leave more than a thousand prior sd: no information.
const LEAST: f64 = 1e-3;
/// Share of a parameter in a direction that passes for rounding.
const ABSENT: f64 = 1e-4;

/// What the data say of the parameters, by direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Fisher {
    prior_sd: Vec<f64>,
    /// Directions v_k in units of the prior sd, p x p, the best informed first.
    vectors: DMatrix<f64>,
    /// s_k, length p; zero for a direction without information.
    singular: DVector<f64>,
    /// Share of a parameter in a direction without information that passes for zero.
    absent: f64,
}

impl Fisher {
    pub(super) fn new(
        scaled: &DMatrix<f64>,
        prior_sd: &[f64],
        accuracy: f64,
    ) -> Result<Self, EstimatorError> {
        let p = scaled.ncols();
        // R of the QR factorisation has the singular values of S_u in p rows.
        let tall = scaled.clone().resize_vertically(scaled.nrows().max(p), 0.0);
        let (_, values, v_t) = spectral::svd(&tall.qr().r(), "sensitivity")?;
        let vectors = v_t.transpose();
        let lengths: Vec<f64> = scaled.column_iter().map(|c| c.norm()).collect();
        let singular = DVector::from_fn(p, |k, _| {
            let v = vectors.column(k);
            let error = v.iter().zip(&lengths).map(|(v, length)| (v * length).powi(2)).sum::<f64>().sqrt();
            let s = values[k];
            if s > LEAST.max(accuracy * error) { s } else { 0.0 }
        });
        // The directions are known no better than the columns.
        Ok(Self { prior_sd: prior_sd.to_vec(), vectors, singular, absent: ABSENT.max(3.0 * accuracy) })
    }

    /// Number of parameters p.
    pub fn n_param(&self) -> usize {
        self.prior_sd.len()
    }

    /// Number of directions that hold information.
    pub fn rank(&self) -> usize {
        self.singular.iter().filter(|s| **s > 0.0).count()
    }

    /// F = S^T S, p x p, per transformed units squared; the prior is not in it.
    pub fn information(&self) -> DMatrix<f64> {
        let u = self.weighted(|s| Some(s * s));
        self.by_parameters(&u, |v, sd| v / sd)
    }

    /// Standard errors by the data alone (the bound of Cramér and Rao), transformed units.
    pub fn standard_errors(&self) -> Vec<Option<f64>> {
        let covariance = self.inverse();
        let hidden = self.hidden();
        let known = |j: usize| {
            (norm_squared(&hidden, j) <= 0.0).then(|| covariance[(j, j)].sqrt() * self.prior_sd[j])
        };
        (0..self.n_param()).map(known).collect()
    }

    /// Correlation of the errors by the data alone, p x p.
    ///
    /// Two parameters of the same direction without information have the limit of their correlation, as when that
    /// direction held ever less; `None` where one of two parameters takes part in such a direction and the other does not.
    pub fn correlation(&self) -> DMatrix<Option<f64>> {
        let covariance = self.inverse();
        let hidden = self.hidden();
        DMatrix::from_fn(self.n_param(), self.n_param(), |i, j| {
            let (of_i, of_j) = (norm_squared(&hidden, i), norm_squared(&hidden, j));
            let (product, square) = match (of_i > 0.0, of_j > 0.0) {
                _ if i == j => return Some(1.0),
                (true, true) => (hidden.row(i).dot(&hidden.row(j)), of_i * of_j),
                (false, false) => (covariance[(i, j)], covariance[(i, i)] * covariance[(j, j)]),
                _ => return None,
            };
            Some((product / square.sqrt()).clamp(-1.0, 1.0))
        })
    }

    /// Covariance that data and prior together would leave, (F + P0^{-1})^{-1}, p x p, transformed units.
    pub fn posterior_covariance(&self) -> DMatrix<f64> {
        let u = self.weighted(|s| Some(1.0 / (1.0 + s * s)));
        self.by_parameters(&u, |v, sd| v * sd)
    }

    /// The parameters as p directions, the least informed first.
    pub fn directions(&self) -> Vec<Direction> {
        let axis = |k: usize| Axis {
            vector: self.vectors.column(k).into_owned(),
            variance: 1.0 / (1.0 + self.singular[k].powi(2)),
            error: (self.singular[k] > 0.0).then(|| self.singular[k].powi(-2)),
        };
        named(&(0..self.n_param()).rev().map(axis).collect::<Vec<_>>())
    }

    /// F^{-1} over the informed directions, in prior sd.
    pub(super) fn inverse(&self) -> DMatrix<f64> {
        self.weighted(|s| (s > 0.0).then(|| 1.0 / (s * s)))
    }

    /// Does the parameter take part in a direction without information?
    pub(super) fn is_hidden(&self, parameter: usize) -> bool {
        norm_squared(&self.hidden(), parameter) > 0.0
    }

    /// The directions without information, one per column; shares that pass for rounding are zero.
    fn hidden(&self) -> DMatrix<f64> {
        let rank = self.rank();
        let columns: Vec<_> = (0..self.n_param())
            .filter(|k| self.singular[*k] <= 0.0)
            .map(|k| self.vectors.column(k).into_owned())
            .collect();
        let mut hidden = DMatrix::zeros(self.n_param(), self.n_param() - rank);
        for (mut to, from) in hidden.column_iter_mut().zip(columns) {
            to.copy_from(&from);
        }
        for mut row in hidden.row_iter_mut() {
            if row.norm() < self.absent {
                row.fill(0.0);
            }
        }
        hidden
    }

    /// V diag(weight(s)) V^T over the directions that have a weight.
    fn weighted(&self, weight: impl Fn(f64) -> Option<f64>) -> DMatrix<f64> {
        let p = self.n_param();
        let mut sum = DMatrix::zeros(p, p);
        for (v, s) in self.vectors.column_iter().zip(&self.singular) {
            if let Some(weight) = weight(*s) {
                sum.ger(weight, &v, &v, 1.0);
            }
        }
        sum
    }

    fn by_parameters(&self, u: &DMatrix<f64>, scale: impl Fn(f64, f64) -> f64) -> DMatrix<f64> {
        let p = self.n_param();
        DMatrix::from_fn(p, p, |i, j| scale(scale(u[(i, j)], self.prior_sd[i]), self.prior_sd[j]))
    }
}

fn norm_squared(rows: &DMatrix<f64>, row: usize) -> f64 {
    rows.row(row).norm_squared()
}
