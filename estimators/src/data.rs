//! Observed values and their noise, checked once before any arithmetic.
//!
//! Deliberately without time or channels: a row is one number that a prediction must match. A missing value is
//! marginalised by leaving its row out, not by giving it a large noise. Read next: `whiten.rs`.

use nalgebra::DMatrix;

use crate::EstimatorError;

/// Largest difference of two mirrored entries of a covariance, relative to the sd of their rows, that passes for rounding.
const ASYMMETRY: f64 = 1e-10;

/// Observation noise of m rows, Gaussian with zero mean.
#[derive(Debug, Clone, PartialEq)]
pub enum Noise {
    /// Independent rows: standard deviation of each, length m, in the unit of its row.
    Diagonal(Vec<f64>),
    /// Covariance, m x m, symmetric; only the block of the observed rows is used.
    Dense(DMatrix<f64>),
}

/// What was observed, m rows.
#[derive(Debug, Clone, Copy)]
pub struct Data<'a> {
    /// Observed values, length m; NaN = missing.
    pub values: &'a [f64],
    /// Their noise.
    pub noise: &'a Noise,
}

impl Data<'_> {
    /// Rows that are observed, in increasing order, after every check that needs no prediction.
    pub(crate) fn observed(&self) -> Result<Vec<usize>, EstimatorError> {
        let m = self.values.len();
        let rows: Vec<usize> = (0..m).filter(|&k| !self.values[k].is_nan()).collect();
        if let Some(&row) = rows.iter().find(|&&k| !self.values[k].is_finite()) {
            return Err(EstimatorError::NonFiniteObservation { row, value: self.values[row] });
        }
        match self.noise {
            Noise::Diagonal(sd) => {
                same("noise standard deviations", m, sd.len())?;
                match rows.iter().find(|&&k| !(sd[k] > 0.0 && sd[k].is_finite())) {
                    Some(&row) => Err(EstimatorError::NoiseNotPositive { row, value: sd[row] }),
                    None => Ok(rows),
                }
            }
            Noise::Dense(covariance) => {
                same("rows of the noise covariance", m, covariance.nrows())?;
                same("columns of the noise covariance", m, covariance.ncols())?;
                symmetric(covariance, &rows)?;
                Ok(rows)
            }
        }
    }
}

/// Is the block of these rows symmetric? What is not a number is left to the factorisation.
fn symmetric(covariance: &DMatrix<f64>, rows: &[usize]) -> Result<(), EstimatorError> {
    for (k, &column) in rows.iter().enumerate() {
        for &row in &rows[..k] {
            let (above, below) = (covariance[(row, column)], covariance[(column, row)]);
            let scale = (covariance[(row, row)] * covariance[(column, column)]).abs().sqrt();
            if (above - below).abs() > ASYMMETRY * scale {
                return Err(EstimatorError::NoiseNotSymmetric { row, column, above, below });
            }
        }
    }
    Ok(())
}

/// Two lengths that must agree.
pub(crate) fn same(what: &'static str, expected: usize, got: usize) -> Result<(), EstimatorError> {
    if expected == got { Ok(()) } else { Err(EstimatorError::Shape { what, expected, got }) }
}
