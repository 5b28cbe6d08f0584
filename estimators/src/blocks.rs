//! Blocks of rows that answer to some of the parameters only, such as the values of one record to what all records share and to
//! the record's own: an ensemble then needs points for the parameters of one block instead of all.
//!
//! The points of all blocks are the columns of one matrix. Every block's offsets are the lower Cholesky factor of its own
//! covariance times the same sigma points, with the shared parameters first: their rows of the factor are those of the shared
//! covariance, the same in every block. Read next: `linearisation.rs`, which puts the slopes of the blocks together.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::{EstimatorError, SigmaSet, spectral};

/// Rows of the data that answer to some of the parameters only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// The rows.
    pub rows: Range<usize>,
    /// The parameters, those that other blocks share first; every block has as many.
    pub parameters: Vec<usize>,
}

/// Number of parameters of the whole.
pub(crate) fn n_param(blocks: &[Block], set: &SigmaSet) -> usize {
    let last = blocks.iter().flat_map(|b| &b.parameters).max();
    last.map_or(set.n_param(), |last| last + 1)
}

/// Offsets of the points of `set` before anything is known: one in each parameter, p x p or, in blocks, p x q.
pub(crate) fn first(blocks: &[Block], set: &SigmaSet) -> DMatrix<f64> {
    let (p, q) = (n_param(blocks, set), set.n_param());
    if blocks.is_empty() {
        return DMatrix::identity(p, p);
    }
    let mut scale = DMatrix::zeros(p, q);
    for block in blocks {
        for (place, &j) in block.parameters.iter().enumerate() {
            scale[(j, place)] = 1.0;
        }
    }
    scale
}

/// Offsets of the points for a posterior covariance (R^T R)^{-1}: the symmetric root of it, p x p, or in blocks the Cholesky
/// factors of their covariances, p x q. `inverse` is R^{-1}. `None` where a block has no Cholesky factor.
pub(crate) fn scale(
    blocks: &[Block],
    root: &DMatrix<f64>,
    inverse: &DMatrix<f64>,
) -> Result<Option<DMatrix<f64>>, EstimatorError> {
    if blocks.is_empty() { inverse_root(root).map(Some) } else { Ok(offsets(blocks, inverse)) }
}

/// The lower Cholesky factor of the covariance of every block, from a factor F of the covariance F F^T, p x p.
fn offsets(blocks: &[Block], factor: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let q = blocks.first()?.parameters.len();
    let mut scale = DMatrix::zeros(factor.nrows(), q);
    for block in blocks {
        let of_block = factor.select_rows(&block.parameters);
        let lower = (&of_block * of_block.transpose()).cholesky()?.unpack();
        for (place, &j) in block.parameters.iter().enumerate() {
            scale.row_mut(j).copy_from(&lower.row(place));
        }
    }
    Some(scale)
}

/// (R^T R)^{-1/2}, symmetric, from the singular values of R.
fn inverse_root(root: &DMatrix<f64>) -> Result<DMatrix<f64>, EstimatorError> {
    let (_, values, vectors) = spectral::svd(root, "posterior")?;
    let sd = DMatrix::from_diagonal(&values.map(|v| 1.0 / v));
    Ok(vectors.tr_mul(&(sd * &vectors)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_block_has_offsets_of_its_own_covariance() {
        let blocks = [
            Block { rows: 0..4, parameters: vec![0, 1, 3] },
            Block { rows: 4..9, parameters: vec![0, 2, 4] },
        ];
        let factor = DMatrix::from_fn(5, 5, |i, j| 1.0 / (1.0 + (2 * i + j) as f64) + f64::from(i == j));
        let scale = offsets(&blocks, &factor).expect("positive definite");
        let covariance = &factor * factor.transpose();
        for block in &blocks {
            let own = scale.select_rows(&block.parameters);
            let wanted = covariance.select_rows(&block.parameters).select_columns(&block.parameters);
            // Exact but for rounding.
            assert!((&own * own.transpose() - wanted).amax() < 1e-14);
        }
    }
}
