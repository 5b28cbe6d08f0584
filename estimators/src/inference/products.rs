//! Products of columns with one another and with those of the next row: the sums that an inference is made of.
//!
//! Blocks of a recording are summed on machines of different kinds and their results are compared bit by bit, so the order of every
//! sum is fixed here whatever the length of a vector register: eight partial sums over every eighth row, added in pairs, a product
//! and a sum rounded each for itself. That costs about half of the speed of `gram.rs`, which serves one machine. The vector
//! instructions are chosen when the program runs. Read next: `stream.rs`, which makes the columns.

#![allow(
    clippy::inline_always,
    reason = "the vector instructions reach a function only when it is inlined into the dispatched one"
)]

use nalgebra::DMatrix;
use pulp::{Simd, WithSimd};

/// Partial sums of every product.
pub(crate) const LANES: usize = 8;
/// Columns on the left and on the right that are multiplied at a time.
const LEFT: usize = 3;
const RIGHT: usize = 2;

/// One block to be added to the sums Σ a_n a_{n+lag}ᵀ.
pub(crate) struct Products<'a> {
    /// Column after column; each is zero beyond the rows that count and has room for one more chunk of LANES.
    pub(crate) columns: &'a [f64],
    /// Length of a column.
    pub(crate) height: usize,
    /// Rows that count.
    pub(crate) rows: usize,
    /// 0, and only the upper triangle is added to, or 1.
    pub(crate) lag: usize,
    /// Sums, as many rows and columns as there are columns.
    pub(crate) sums: &'a mut DMatrix<f64>,
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let n = self.sums.ncols();
        let padded = self.rows.next_multiple_of(LANES);
        let column = |j: usize, shift: usize| {
            let start = j.min(n - 1) * self.height + shift;
            self.columns[start..start + padded].as_chunks::<LANES>().0
        };
        for b in (0..n).step_by(RIGHT) {
            let right = std::array::from_fn(|j| column(b + j, self.lag));
            let last = if self.lag == 0 { (b + RIGHT).min(n) } else { n };
            for a in (0..last).step_by(LEFT) {
                let left = std::array::from_fn(|i| column(a + i, 0));
                let tile = tile(left, right);
                for (i, j) in (0..LEFT).flat_map(|i| (0..RIGHT).map(move |j| (i, j))) {
                    if a + i < n && b + j < n && (self.lag > 0 || a + i <= b + j) {
                        self.sums[(a + i, b + j)] += total(&tile[i * RIGHT + j]);
                    }
                }
            }
        }
    }
}

type Chunks<'a> = &'a [[f64; LANES]];

/// Partial sums of the products of three columns with two others.
#[inline(always)]
fn tile(left: [Chunks<'_>; LEFT], right: [Chunks<'_>; RIGHT]) -> [[f64; LANES]; LEFT * RIGHT] {
    let mut sums = [[0.0; LANES]; LEFT * RIGHT];
    let ([l0, l1, l2], [r0, r1]) = (left, right);
    for ((((l0, l1), l2), r0), r1) in l0.iter().zip(l1).zip(l2).zip(r0).zip(r1) {
        for (i, l) in [l0, l1, l2].into_iter().enumerate() {
            for (j, r) in [r0, r1].into_iter().enumerate() {
                for k in 0..LANES {
                    sums[i * RIGHT + j][k] += l[k] * r[k];
                }
            }
        }
    }
    sums
}

#[inline(always)]
fn total(parts: &[f64; LANES]) -> f64 {
    let [a, b, c, d, e, f, g, h] = parts;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

#[cfg(test)]
mod tests {
    use pulp::{Arch, Scalar};

    use super::*;

    fn products(run: impl Fn(Products<'_>), lag: usize) -> DMatrix<f64> {
        let (height, rows, n) = (48, 37, 5);
        let mut columns = vec![0.0; height * n];
        for (i, value) in columns.iter_mut().enumerate().filter(|(i, _)| i % 48 < 37) {
            *value = (i as f64 * 0.731).sin() + 1e3 * (i % 3) as f64;
        }
        let mut sums = DMatrix::zeros(n, n);
        run(Products { columns: &columns, height, rows, lag, sums: &mut sums });
        let column = |j: usize| &columns[j * height..];
        for j in 0..n {
            for i in 0..if lag == 0 { j + 1 } else { n } {
                let pairs = column(i)[..rows - lag].iter().zip(&column(j)[lag..rows]);
                let expected: f64 = pairs.map(|(a, b)| a * b).sum();
                assert!((sums[(i, j)] - expected).abs() < 1e-14 * 37.0 * 1e7, "rounding of 37 products");
            }
        }
        sums
    }

    #[test]
    fn the_sums_are_right_and_have_the_same_bits_with_any_instructions() {
        for lag in [0, 1] {
            let plain = products(|p| p.with_simd(Scalar), lag);
            let vector = products(|p| Arch::new().dispatch(p), lag);
            assert_eq!(plain, vector);
        }
    }
}
