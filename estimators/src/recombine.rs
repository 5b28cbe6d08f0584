//! X+ = X- T: the states after an analysis, the one place where estimation touches large arrays.
//!
//! Bound by memory when done well: the result goes to a buffer of the caller (a fresh one would pay page faults), a
//! few rows of all particles are packed together, and every register holds a piece of the result until it is complete.
//! The vector instructions are chosen when the program runs. Deliberately one thread: the memory bus is the limit.
//! Read next: `roukf.rs`, which makes T.

#![allow(
    clippy::inline_always,
    reason = "the vector instructions reach a function only when it is inlined into the dispatched one"
)]

use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

/// Columns of the result made at a time, two registers each.
const GROUP: usize = 6;
/// Bytes of X packed at a time: long runs of every column, which the memory likes, and still a second-level cache.
const PACKED: usize = 384 * 1024;

/// Writes X T into `out`: `x` is n x r, a particle per column, `t` is r x r, `out` is n x r.
///
/// A column of X whose row in T is zero (a dropped particle) is not read as a number: it may hold NaN.
///
/// # Panics
/// When the shapes do not match.
pub fn recombine(x: &DMatrix<f64>, t: &DMatrix<f64>, out: &mut DMatrix<f64>) {
    assert_eq!(x.ncols(), t.nrows(), "one row of the transform per particle");
    assert_eq!((x.nrows(), t.ncols()), out.shape(), "the result has the rows of X and the columns of T");
    let used: Vec<usize> = (0..t.nrows()).filter(|&i| t.row(i).iter().any(|v| v.abs() > 0.0)).collect();
    if out.is_empty() {
        return;
    }
    Arch::new().dispatch(Recombination { x, t, used, out });
}

struct Recombination<'a> {
    x: &'a DMatrix<f64>,
    t: &'a DMatrix<f64>,
    /// Particles that take part.
    used: Vec<usize>,
    out: &'a mut DMatrix<f64>,
}

impl Recombination<'_> {
    /// T in groups of columns: for each group, for each used row, its GROUP coefficients (zero beyond the last column).
    fn packed_transform(&self) -> Vec<f64> {
        let mut packed = Vec::with_capacity(self.used.len() * (self.t.ncols() + GROUP));
        for first in (0..self.t.ncols()).step_by(GROUP) {
            for &i in &self.used {
                packed.extend(
                    (first..first + GROUP).map(|j| if j < self.t.ncols() { self.t[(i, j)] } else { 0.0 }),
                );
            }
        }
        packed
    }
}

impl WithSimd for Recombination<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let n = self.x.nrows();
        let coefficients = self.packed_transform();
        let tile = 2 * S::F64_LANES;
        let n_tile = (PACKED / (size_of::<f64>() * tile * self.used.len().max(1))).clamp(4, 256);
        let block = n_tile * tile;
        let mut packed = vec![simd.splat_f64s(0.0); 2 * n_tile * self.used.len()];
        let group = self.used.len() * GROUP;
        if group == 0 {
            return self.out.fill(0.0);
        }
        let result = self.out.as_mut_slice();
        for first in (0..n).step_by(block) {
            let rows = block.min(n - first);
            let tiles = rows.div_ceil(tile);
            for (k, &i) in self.used.iter().enumerate() {
                let column = &self.x.as_slice()[i * n + first..i * n + first + rows];
                for (piece, place) in column.chunks(tile).zip(packed.chunks_exact_mut(2 * self.used.len())) {
                    (place[2 * k], place[2 * k + 1]) = load(simd, piece);
                }
            }
            for (g, coefficients) in coefficients.chunks_exact(group).enumerate() {
                let columns = GROUP.min(self.t.ncols() - g * GROUP);
                for (s, x) in packed.chunks_exact(2 * self.used.len()).take(tiles).enumerate() {
                    let sums = product(simd, x, coefficients);
                    let start = first + s * tile;
                    let height = tile.min(n - start);
                    for (j, (lo, hi)) in sums.into_iter().enumerate().take(columns) {
                        let place = (g * GROUP + j) * n + start;
                        store(simd, &mut result[place..place + height], lo, hi);
                    }
                }
            }
        }
    }
}

/// Rows of two registers times GROUP columns of coefficients.
#[inline(always)]
fn product<S: Simd>(simd: S, x: &[S::f64s], coefficients: &[f64]) -> [(S::f64s, S::f64s); GROUP] {
    let zero = simd.splat_f64s(0.0);
    let mut sums = [(zero, zero); GROUP];
    for (x, c) in x.chunks_exact(2).zip(coefficients.chunks_exact(GROUP)) {
        for (sum, c) in sums.iter_mut().zip(c) {
            let c = simd.splat_f64s(*c);
            sum.0 = simd.mul_add_e_f64s(x[0], c, sum.0);
            sum.1 = simd.mul_add_e_f64s(x[1], c, sum.1);
        }
    }
    sums
}

/// Two registers from up to two registers' length of numbers, the rest zero.
#[inline(always)]
fn load<S: Simd>(simd: S, piece: &[f64]) -> (S::f64s, S::f64s) {
    if let ([lo, hi], []) = S::as_simd_f64s(piece) {
        return (*lo, *hi);
    }
    let (lo, hi) = piece.split_at(piece.len().min(S::F64_LANES));
    (simd.partial_load_f64s(lo), simd.partial_load_f64s(hi))
}

/// The reverse of [`load`].
#[inline(always)]
fn store<S: Simd>(simd: S, piece: &mut [f64], lo: S::f64s, hi: S::f64s) {
    if let ([a, b], []) = S::as_mut_simd_f64s(piece) {
        (*a, *b) = (lo, hi);
        return;
    }
    let (a, b) = piece.split_at_mut(piece.len().min(S::F64_LANES));
    simd.partial_store_f64s(a, lo);
    simd.partial_store_f64s(b, hi);
}
