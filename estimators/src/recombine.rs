//! X+ = X- T: the states after an analysis, the one place where estimation touches large arrays.
//!
//! Bound by memory, so the result goes to a buffer of the caller (a fresh one would pay page faults) and a block of rows
//! stays in cache while all its columns are made. Deliberately one thread: what limits it is the memory bus.
//! Read next: `roukf.rs`, which makes T.

use nalgebra::DMatrix;

/// Rows per block.
const BLOCK: usize = 4096;

/// Writes X T into `out`: `x` is n x r, a particle per column, `t` is r x r, `out` is n x r.
///
/// A column of X whose row in T is zero (a dropped particle) is not read as a number: it may hold NaN.
///
/// # Panics
/// When the shapes do not match.
pub fn recombine(x: &DMatrix<f64>, t: &DMatrix<f64>, out: &mut DMatrix<f64>) {
    let n = x.nrows();
    assert_eq!(x.ncols(), t.nrows(), "one row of the transform per particle");
    assert_eq!((n, t.ncols()), out.shape(), "the result has the rows of X and the columns of T");
    let used: Vec<usize> = (0..t.nrows()).filter(|&i| t.row(i).iter().any(|v| v.abs() > 0.0)).collect();
    if used.len() < t.nrows() {
        let (x, t) = (x.select_columns(&used), t.select_rows(&used));
        return blocks(&x, &t, out);
    }
    blocks(x, t, out);
}

fn blocks(x: &DMatrix<f64>, t: &DMatrix<f64>, out: &mut DMatrix<f64>) {
    let n = x.nrows();
    for first in (0..n).step_by(BLOCK) {
        let rows = BLOCK.min(n - first);
        out.rows_mut(first, rows).gemm(1.0, &x.rows(first, rows), t, 0.0);
    }
}
