//! The damped step by QR of the stacked rows (J; P^1/2; damping): their square, which has twice the digits, is never formed.
//!
//! Deliberately without bounds: the caller says which components are free. Next files to read: [`super`],
//! `block_angular/reduction.rs`, which factors the rows.

use nalgebra::DVector;

use super::LeastSquares;
use crate::block_angular::Diagonal;

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
    let root = fit.prior.precision.map(f64::sqrt);
    let prior = Diagonal { right: root.component_mul(pull), entries: root };
    let damping = curvature.map(|c| (c * (fit.damping + LEAST_DAMPING)).sqrt());
    let damping = Diagonal { entries: damping, right: DVector::zeros(pull.len()) };
    let solved = fit.jacobian.least_squares(free, &fit.residual, &[prior, damping])?;
    Some(solved.select_rows(free))
}
