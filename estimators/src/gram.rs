//! The Gram matrix of a block of columns, in vector registers: half the products, and no copy of the block.
//!
//! A register tile holds the sums of 3 x 3 pairs of columns until the block's rows are done, which leaves the arithmetic
//! as the limit on sixteen registers as on thirty-two. Deliberately only the upper triangle.
//! Read next: `information.rs`, which reads the whole.

#![allow(
    clippy::inline_always,
    reason = "the vector instructions reach a function only when it is inlined into the dispatched one"
)]

use nalgebra::DMatrix;
use pulp::{Simd, WithSimd};

/// Columns of a register tile.
pub(crate) const TILE: usize = 3;
/// Rows are filled up with zeros to a multiple of this, which every vector length divides.
const LANES: usize = 16;

/// One block to be added to the Gram matrix.
pub(crate) struct Gram<'a> {
    /// A multiple of LANES rows, a multiple of TILE columns; the columns beyond the Gram matrix are zero.
    pub(crate) columns: &'a mut DMatrix<f64>,
    /// Rows that count.
    pub(crate) rows: usize,
    /// Gram matrix; its upper triangle is added to.
    pub(crate) products: &'a mut DMatrix<f64>,
}

impl WithSimd for Gram<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (height, width) = self.columns.shape();
        let padded = self.rows.next_multiple_of(LANES);
        for column in self.columns.as_mut_slice().chunks_exact_mut(height) {
            column[self.rows..padded].fill(0.0);
        }
        let values = self.columns.as_slice();
        let tile = |first: usize| -> [&[S::f64s]; TILE] {
            std::array::from_fn(|i| {
                let start = (first + i) * height;
                S::as_simd_f64s(&values[start..start + padded]).0
            })
        };
        for b in (0..width).step_by(TILE) {
            let right = tile(b);
            for a in (0..=b).step_by(TILE) {
                let sums = products(simd, tile(a), right);
                for (i, j) in (0..TILE).flat_map(|i| (0..TILE).map(move |j| (i, j))) {
                    if a + i <= b + j && b + j < self.products.ncols() {
                        self.products[(a + i, b + j)] += simd.reduce_sum_f64s(sums[i][j]);
                    }
                }
            }
        }
    }
}

/// Sums over rows of the products of three columns with three others.
#[inline(always)]
fn products<S: Simd>(
    simd: S,
    left: [&[S::f64s]; TILE],
    right: [&[S::f64s]; TILE],
) -> [[S::f64s; TILE]; TILE] {
    let mut sums = [[simd.splat_f64s(0.0); TILE]; TILE];
    let [l0, l1, l2] = left;
    let [r0, r1, r2] = right;
    for (((((l0, l1), l2), r0), r1), r2) in l0.iter().zip(l1).zip(l2).zip(r0).zip(r1).zip(r2) {
        for (sums, l) in sums.iter_mut().zip([l0, l1, l2]) {
            for (sum, r) in sums.iter_mut().zip([r0, r1, r2]) {
                *sum = simd.mul_add_e_f64s(*l, *r, *sum);
            }
        }
    }
    sums
}
