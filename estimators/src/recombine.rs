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

use std::ops::Range;

use nalgebra::DMatrix;
use pulp::{Arch, Simd, WithSimd};

/// Columns of the result made at a time, two registers each, with sixteen registers.
const NARROW: usize = 6;
/// The same with thirty-two registers; the one is taken that leaves the fewest columns of the last group empty.
const WIDE: [usize; 3] = [12, 11, 10];
/// Bytes of X packed at a time: long runs of every column, which the memory likes, and two still fit a second-level cache.
const PACKED: usize = 256 * 1024;

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
    /// T in groups of columns: for each group, for each used row, its G coefficients (zero beyond the last column).
    fn packed_transform<const G: usize>(&self) -> Vec<f64> {
        let mut packed = Vec::with_capacity(self.used.len() * (self.t.ncols() + G));
        for first in (0..self.t.ncols()).step_by(G) {
            for &i in &self.used {
                packed.extend(
                    (first..first + G).map(|j| if j < self.t.ncols() { self.t[(i, j)] } else { 0.0 }),
                );
            }
        }
        packed
    }

    /// All of it, G columns at a time. While one block is multiplied the next is read, a run of a column after each
    /// tile, so that memory and arithmetic work at the same time.
    #[inline(always)]
    fn run<S: Simd, const G: usize>(self, simd: S) {
        let (n, n_used) = (self.x.nrows(), self.used.len());
        if n_used == 0 {
            return self.out.fill(0.0);
        }
        let coefficients = self.packed_transform::<G>();
        let n_group = self.t.ncols().div_ceil(G);
        let tile = 2 * S::F64_LANES;
        let n_tile = (PACKED / (size_of::<f64>() * tile * n_used)).clamp(4, 256);
        let block = n_tile * tile;
        let empty = vec![simd.splat_f64s(0.0); 2 * n_tile * n_used];
        let (mut packed, mut ahead) = (empty.clone(), empty);
        let mut packer = Packer::new(self.x, &self.used, tile, 0..block.min(n));
        packer.advance(simd, &mut packed, usize::MAX);
        let result = self.out.as_mut_slice();
        for first in (0..n).step_by(block) {
            let tiles = block.min(n - first).div_ceil(tile);
            let next = (first + block).min(n)..(first + 2 * block).min(n);
            let mut packer = Packer::new(self.x, &self.used, tile, next);
            let quota = packer.n_piece().div_ceil(tiles * n_group);
            for (g, coefficients) in coefficients.chunks_exact(n_used * G).enumerate() {
                let columns = G.min(self.t.ncols() - g * G);
                for (s, x) in packed.chunks_exact(2 * n_used).take(tiles).enumerate() {
                    let sums = product::<S, G>(simd, x, coefficients);
                    let start = first + s * tile;
                    let height = tile.min(n - start);
                    for (j, (lo, hi)) in sums.into_iter().enumerate().take(columns) {
                        let place = (g * G + j) * n + start;
                        store(simd, &mut result[place..place + height], lo, hi);
                    }
                    packer.advance(simd, &mut ahead, quota);
                }
            }
            std::mem::swap(&mut packed, &mut ahead);
        }
    }
}

impl WithSimd for Recombination<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if S::F64_LANES < 8 {
            return self.run::<S, NARROW>(simd);
        }
        let r = self.t.ncols();
        match WIDE.into_iter().min_by_key(|g| r.next_multiple_of(*g)) {
            Some(10) => self.run::<S, 10>(simd),
            Some(11) => self.run::<S, 11>(simd),
            _ => self.run::<S, 12>(simd),
        }
    }
}

/// Copies a range of rows of X into tiles, all particles of a tile side by side, as many pieces at a time as asked for.
struct Packer<'a> {
    x: &'a DMatrix<f64>,
    used: &'a [usize],
    /// Rows of a tile.
    tile: usize,
    rows: Range<usize>,
    /// The next piece: particle (a place in `used`) and tile.
    at: (usize, usize),
}

impl<'a> Packer<'a> {
    fn new(x: &'a DMatrix<f64>, used: &'a [usize], tile: usize, rows: Range<usize>) -> Self {
        Self { x, used, tile, rows, at: (0, 0) }
    }

    fn n_piece(&self) -> usize {
        self.used.len() * self.rows.len().div_ceil(self.tile)
    }

    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S, packed: &mut [S::f64s], mut n_piece: usize) {
        let tiles = self.rows.len().div_ceil(self.tile);
        while n_piece > 0 && tiles > 0 && self.at.0 < self.used.len() {
            let (k, s) = self.at;
            let end = tiles.min(s.saturating_add(n_piece));
            let start = self.used[k] * self.x.nrows() + self.rows.start;
            let column = &self.x.as_slice()[start..start + self.rows.len()];
            let column = &column[s * self.tile..self.rows.len().min(end * self.tile)];
            let places = packed.chunks_exact_mut(2 * self.used.len()).skip(s);
            for (piece, place) in column.chunks(self.tile).zip(places) {
                (place[2 * k], place[2 * k + 1]) = load(simd, piece);
            }
            n_piece -= end - s;
            self.at = if end == tiles { (k + 1, 0) } else { (k, end) };
        }
    }
}

/// Rows of two registers times G columns of coefficients.
#[inline(always)]
fn product<S: Simd, const G: usize>(simd: S, x: &[S::f64s], coefficients: &[f64]) -> [(S::f64s, S::f64s); G] {
    let zero = simd.splat_f64s(0.0);
    let mut sums = [(zero, zero); G];
    for (x, c) in x.chunks_exact(2).zip(coefficients.chunks_exact(G)) {
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
