//! The last step of a singular value decomposition: rotations of pairs of columns until all are orthogonal.
//!
//! One-sided Jacobi (Hestenes 1958; Demmel & Veselić 1992, algorithm 4.1). nalgebra's implicit QR iteration ends with orthonormal
//! vectors V, but now and then with singular values that are wrong in the second digit (a matrix of ones, 3 x 5, is such a
//! case). The columns of M V show it: they are orthogonal to rounding where V is right, and their lengths are the singular
//! values. Where V is right this step is one look at every pair.

use nalgebra::{DMatrix, DVector};

/// Sweeps over all pairs of columns. From any start some ten suffice.
const MOST_SWEEPS: usize = 60;

/// U, s in decreasing order and V^T of M = U diag(s) V^T, from M, n x p with n >= p, and orthonormal columns V, p x p, that are
/// about its right singular vectors. `None` when the sweeps do not end.
pub(super) fn finish(m: &DMatrix<f64>, mut v: DMatrix<f64>) -> Option<super::Svd> {
    // Squares of the entries neither overflow nor vanish.
    let unit = if m.amax() > 0.0 { m.amax() } else { 1.0 };
    let mut w = (m / unit) * &v;
    if !(0..MOST_SWEEPS).any(|_| is_orthogonal_after_sweep(&mut w, &mut v)) {
        return None;
    }
    let lengths: Vec<f64> = w.column_iter().map(|c| c.norm()).collect();
    let mut order: Vec<usize> = (0..lengths.len()).collect();
    order.sort_by(|a, b| lengths[*b].total_cmp(&lengths[*a]));
    let w = w.select_columns(&order);
    let values = DVector::from_iterator(order.len(), order.iter().map(|k| unit * lengths[*k]));
    // Columns of length zero have no direction: the factor Q has one for them that is orthogonal to the others.
    let (mut u, triangle) = w.qr().unpack();
    for (k, mut column) in u.column_iter_mut().enumerate() {
        if triangle[(k, k)] < 0.0 {
            column.neg_mut();
        }
    }
    Some((u, values, v.select_columns(&order).transpose()))
}

/// Rotates every pair of columns of W, and of V with it, that is not orthogonal to rounding. Whether there was none.
fn is_orthogonal_after_sweep(w: &mut DMatrix<f64>, v: &mut DMatrix<f64>) -> bool {
    let rounding = f64::EPSILON * (w.nrows() as f64).max(8.0);
    // What is left of a column that is zero but for rounding has no direction.
    let none = rounding * w.column_iter().map(|c| c.norm_squared()).fold(0.0, f64::max).sqrt();
    let mut none_turned = true;
    for i in 0..w.ncols() {
        for j in i + 1..w.ncols() {
            let (a, b) = (w.column(i).norm(), w.column(j).norm());
            let cosine = (w.column(i) / a).dot(&(w.column(j) / b));
            if a.min(b) <= none || cosine.abs() <= rounding {
                continue;
            }
            none_turned = false;
            let zeta = (b / a - a / b) / (2.0 * cosine);
            let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
            rotate(w, i, j, tangent);
            rotate(v, i, j, tangent);
        }
    }
    none_turned
}

/// (x_i, x_j) becomes (c x_i - s x_j, s x_i + c x_j) with the tangent s / c.
fn rotate(x: &mut DMatrix<f64>, i: usize, j: usize, tangent: f64) {
    let c = 1.0 / tangent.hypot(1.0);
    let s = c * tangent;
    for row in 0..x.nrows() {
        let (a, b) = (x[(row, i)], x[(row, j)]);
        x[(row, i)] = c * a - s * b;
        x[(row, j)] = s * a + c * b;
    }
}
