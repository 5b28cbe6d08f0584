//! Products of columns with those of the next row, in vector registers.
//!
//! The same register tiles as the Gram matrix, over all pairs of columns: the right ones start one row later.
//! Read next: `stream.rs`, which makes the columns.

#![allow(
    clippy::inline_always,
    reason = "the vector instructions reach a function only when it is inlined into the dispatched one"
)]

use nalgebra::DMatrix;
use pulp::{Simd, WithSimd};

use crate::gram::{TILE, products};

/// Rows are taken up to a multiple of this, which every vector length divides.
pub(crate) const LANES: usize = 16;

/// One block to be added to the sums Σ a_n a_{n+1}^T.
pub(crate) struct Lagged<'a> {
    /// More rows than the next multiple of LANES, zero beyond those that count; a multiple of TILE columns.
    pub(crate) columns: &'a DMatrix<f64>,
    /// Rows that count.
    pub(crate) rows: usize,
    /// Sums, added to.
    pub(crate) products: &'a mut DMatrix<f64>,
}

impl WithSimd for Lagged<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (height, width) = self.columns.shape();
        let padded = self.rows.next_multiple_of(LANES);
        let values = self.columns.as_slice();
        let tile = |first: usize, shift: usize| -> [&[S::f64s]; TILE] {
            std::array::from_fn(|i| {
                let start = (first + i) * height + shift;
                S::as_simd_f64s(&values[start..start + padded]).0
            })
        };
        let n = self.products.ncols();
        for b in (0..width).step_by(TILE) {
            let right = tile(b, 1);
            for a in (0..width).step_by(TILE) {
                let sums = products(simd, tile(a, 0), right);
                for (i, j) in (0..TILE).flat_map(|i| (0..TILE).map(move |j| (i, j))) {
                    if a + i < n && b + j < n {
                        self.products[(a + i, b + j)] += simd.reduce_sum_f64s(sums[i][j]);
                    }
                }
            }
        }
    }
}
