//! X+ = X- T: the states after an analysis, the one place where estimation touches large arrays.
//!
//! Bound by memory when done well: the result goes to a buffer of the caller (a fresh one would pay page faults), a
//! few rows of all particles are packed together, and every register holds a piece of the result until it is complete.
//! The vector instructions are chosen when the program runs. Matrices far beyond the caches are shared out by rows over a
//! few threads; every row is made the same way whoever makes it, so the bits do not know how many there were.
//! Read next: `roukf.rs`, which makes T.

#![allow(
    clippy::inline_always,
    reason = "the vector instructions reach a function only when it is inlined into the dispatched one"
)]

use std::ops::Range;

use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

/// Columns of the result made at a time, two registers each.
const GROUP: usize = 6;
/// Bytes of X packed at a time: long runs of every column, which the memory likes, and still a second-level cache.
const PACKED: usize = 384 * 1024;

/// Numbers in X from which threads pay for themselves: 32 MiB.
const SHARED: usize = 4 * 1024 * 1024;
/// Threads at most: more do not move the memory bus.
const THREADS: usize = 4;

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
    let n = x.nrows();
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = if x.len() < SHARED { 1 } else { cores.min(THREADS) };
    let mut rest: Vec<&mut [f64]> = out.as_mut_slice().chunks_exact_mut(n).collect();
    std::thread::scope(|scope| {
        for k in 0..threads {
            let rows = n * k / threads..n * (k + 1) / threads;
            let out = rest.iter_mut().filter_map(|column| column.split_off_mut(..rows.len())).collect();
            let part = Recombination { x, t, used: &used, rows, out };
            if k + 1 == threads {
                Arch::new().dispatch(part);
            } else {
                scope.spawn(move || Arch::new().dispatch(part));
            }
        }
    });
}

struct Recombination<'a> {
    x: &'a DMatrix<f64>,
    t: &'a DMatrix<f64>,
    /// Particles that take part.
    used: &'a [usize],
    /// Rows to make.
    rows: Range<usize>,
    /// The columns of the result, these rows of them.
    out: Vec<&'a mut [f64]>,
}

impl Recombination<'_> {
    /// T in groups of columns: for each group, for each used row, its GROUP coefficients (zero beyond the last column).
    fn packed_transform(&self) -> Vec<f64> {
        let mut packed = Vec::with_capacity(self.used.len() * (self.t.ncols() + GROUP));
        for first in (0..self.t.ncols()).step_by(GROUP) {
            for &i in self.used {
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
    fn with_simd<S: Simd>(mut self, simd: S) {
        let n = self.x.nrows();
        let coefficients = self.packed_transform();
        let tile = 2 * S::F64_LANES;
        let n_tile = (PACKED / (size_of::<f64>() * tile * self.used.len().max(1))).clamp(4, 256);
        let block = n_tile * tile;
        let mut packed = vec![simd.splat_f64s(0.0); 2 * n_tile * self.used.len()];
        let group = self.used.len() * GROUP;
        if group == 0 {
            return self.out.iter_mut().for_each(|column| column.fill(0.0));
        }
        for first in self.rows.clone().step_by(block) {
            let rows = block.min(self.rows.end - first);
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
                    let start = first + s * tile - self.rows.start;
                    let height = tile.min(self.rows.len() - start);
                    for (column, (lo, hi)) in self.out[g * GROUP..g * GROUP + columns].iter_mut().zip(sums) {
                        store(simd, &mut column[start..start + height], lo, hi);
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
