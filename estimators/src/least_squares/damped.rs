//! The damped step by QR of the stacked rows (J; P^1/2; damping): their square, which has twice the digits, is never formed.
//!
//! Deliberately without bounds: the caller says which components are free. Next file to read: [`super`].

use nalgebra::DVector;

use super::LeastSquares;
use crate::qr;

/// Damping of every step, which keeps columns apart that are dependent but for rounding.
const LEAST_DAMPING: f64 = 1e-12;

/// The step of the free components; `pull` is prior mean minus z, `curvature` the diagonal of J^T J + P, both of length p.
/// `None` when it is not finite.
pub(super) fn solve(
    fit: &LeastSquares,
    free: &[usize],
    pull: &DVector<f64>,
    curvature: &DVector<f64>,
) -> Option<DVector<f64>> {
    let (m, n) = (fit.residual.len(), free.len());
    let mut rows = fit.jacobian.select_columns(free).resize(m + 2 * n, n + 1, 0.0);
    rows.view_mut((0, n), (m, 1)).copy_from(&fit.residual);
    for (k, &j) in free.iter().enumerate() {
        let root = fit.prior.precision[j].sqrt();
        rows[(m + k, k)] = root;
        rows[(m + k, n)] = root * pull[j];
        rows[(m + n + k, k)] = (curvature[j] * (fit.damping + LEAST_DAMPING)).sqrt();
    }
    let triangle = qr::triangle(rows);
    let right = triangle.view((0, n), (n, 1)).column(0).into_owned();
    let solved = triangle.view((0, 0), (n, n)).solve_upper_triangular(&right)?;
    solved.iter().all(|v| v.is_finite()).then_some(solved)
}
