//! X+ = X- T: the states after an analysis, the one place where estimation touches large arrays.
//!
//! The product is made in place: a few rows of all particles are packed together, and their result goes into the lines
//! they came from, which are still in the first cache. A second matrix would cost half as much traffic again, since memory
//! reads a line before it writes one. While a block is multiplied, the one after the next is fetched. Every register
//! holds a piece of the result until it is complete; the vector instructions are chosen when the program runs. Matrices
//! far beyond the caches are cut by rows into shares for the caller's threads; a row is computed in the same way in every
//! share, so the bits do not depend on their number. Read next: `roukf.rs`, which makes T.

#![allow(
    clippy::inline_always,
    reason = "the vector instructions reach a function only when it is inlined into the dispatched one"
)]

use nalgebra::DMatrix;
use prefetch_index::prefetch_index;
use pulp::{Arch, Simd, WithSimd};

/// Columns of the result made at a time, two registers each.
const GROUP: usize = 6;
/// Tiles of two registers' rows packed at a time: with their result they stay in the first-level cache.
const TILES: usize = 4;
/// Blocks between the one that is multiplied and the one that is fetched.
const AHEAD: usize = 2;

/// Numbers in X from which several threads are faster than one: 32 MiB.
const SHARED: usize = 4 * 1024 * 1024;
/// Threads at most: the memory bandwidth limits more of them.
const THREADS: usize = 4;

/// Replaces X by X T: `x` is n x r, a particle per column, `t` is r x r.
///
/// A column of X whose row in T is zero (a dropped particle) is not read as a number: it may hold NaN.
///
/// # Panics
/// When the shapes do not match.
pub fn recombine(x: &mut DMatrix<f64>, t: &DMatrix<f64>) {
    Recombination::shares(x, t, 1).into_iter().for_each(Recombination::run);
}

/// Some rows of X, to be replaced by those of X T.
pub struct Recombination<'a> {
    /// Some rows of X, a column per particle.
    x: Vec<&'a mut [f64]>,
    t: &'a DMatrix<f64>,
    /// Particles that take part.
    used: Vec<usize>,
}

impl<'a> Recombination<'a> {
    /// [`recombine`] in pieces that may be made at the same time: up to `threads` of them when X is large, else one, none
    /// when X is empty.
    ///
    /// # Panics
    /// When the shapes do not match.
    pub fn shares(x: &'a mut DMatrix<f64>, t: &'a DMatrix<f64>, threads: usize) -> Vec<Self> {
        assert_eq!((x.ncols(), x.ncols()), t.shape(), "one row and one column of the transform per particle");
        if x.is_empty() {
            return Vec::new();
        }
        let used: Vec<usize> = (0..t.nrows()).filter(|&i| t.row(i).iter().any(|v| v.abs() > 0.0)).collect();
        let n = x.nrows();
        let threads = if x.len() < SHARED { 1 } else { threads.clamp(1, THREADS) };
        let mut rest: Vec<&mut [f64]> = x.as_mut_slice().chunks_exact_mut(n).collect();
        let share = |k| {
            let rows = n * (k + 1) / threads - n * k / threads;
            let x = rest.iter_mut().filter_map(|column| column.split_off_mut(..rows)).collect();
            Self { x, t, used: used.clone() }
        };
        (0..threads).map(share).collect()
    }

    /// Replaces the rows.
    pub fn run(self) {
        Arch::new().dispatch(self);
    }
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

    /// One place (column, row) in each register's length of the block of rows that starts at `first`.
    #[inline(always)]
    fn lines<S: Simd>(&self, first: usize) -> impl Iterator<Item = (usize, usize)> + use<S> {
        let last = self.x[0].len().min(first + TILES * 2 * S::F64_LANES);
        (0..self.x.len())
            .flat_map(move |column| (first..last).step_by(S::F64_LANES).map(move |row| (column, row)))
    }
}

impl WithSimd for Recombination<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let n = self.x[0].len();
        let group = self.used.len() * GROUP;
        if group == 0 {
            return self.x.iter_mut().for_each(|column| column.fill(0.0));
        }
        let coefficients = self.packed_transform();
        let tile = 2 * S::F64_LANES;
        let mut packed = vec![simd.splat_f64s(0.0); 2 * TILES * self.used.len()];
        for first in (0..n).step_by(TILES * tile) {
            let rows = (TILES * tile).min(n - first);
            let tiles = rows.div_ceil(tile);
            for (k, &i) in self.used.iter().enumerate() {
                let column = &self.x[i][first..first + rows];
                for (piece, place) in column.chunks(tile).zip(packed.chunks_exact_mut(2 * self.used.len())) {
                    (place[2 * k], place[2 * k + 1]) = load(simd, piece);
                }
            }
            let mut ahead = self.lines::<S>(first + AHEAD * TILES * tile);
            for (g, coefficients) in coefficients.chunks_exact(group).enumerate() {
                let columns = GROUP.min(self.x.len() - g * GROUP);
                for (s, packed) in packed.chunks_exact(2 * self.used.len()).take(tiles).enumerate() {
                    for (column, row) in ahead.by_ref().take(2 * GROUP) {
                        prefetch_index(&*self.x[column], row);
                    }
                    let sums = product(simd, packed, coefficients);
                    let rows = first + s * tile..(first + (s + 1) * tile).min(n);
                    for (column, (lo, hi)) in self.x[g * GROUP..g * GROUP + columns].iter_mut().zip(sums) {
                        store(simd, &mut column[rows.clone()], lo, hi);
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
