//! The damped step by QR of the stacked rows (J; P^1/2; damping): their square, which has twice the digits, is never formed.
//!
//! The damping follows from the region of trust. Deliberately without bounds: the caller says which components are free. Next files to
//! read: [`super`], `block_angular/reduction.rs`, which factors the rows.

use nalgebra::DVector;

use super::LeastSquares;
use crate::block_angular::Diagonal;

/// Damping of every step, which keeps columns apart that are dependent but for rounding ...
const LEAST_DAMPING: f64 = 1e-12;
/// ... and the largest, with which next to nothing is left of one.
const MOST_DAMPING: f64 = 1e8;
/// A step within the region of trust uses so much of its radius.
pub(super) const USED: f64 = 0.8;
/// Halvings of the interval of the damping, in its logarithm, at most.
const HALVINGS: usize = 24;

/// The step of the free components within the region of trust, for what is `left` of the residual (m); `pull` is prior mean minus z,
/// `curvature` the diagonal of J^T J + P, both of length p. `None` when it is not finite.
///
/// The damping is what makes the step as long as the radius allows (Moré 1978), however small it must be: in a narrow valley a damping of
/// a fixed share of the curvature forbids every step along it.
pub(super) fn solve(
    fit: &LeastSquares,
    free: &[usize],
    left: &DVector<f64>,
    pull: &DVector<f64>,
    curvature: &DVector<f64>,
) -> Option<DVector<f64>> {
    let of_radius = |step: &DVector<f64>| {
        let squares = step.iter().zip(free).map(|(s, j)| curvature[*j] * s * s);
        squares.sum::<f64>().sqrt() / fit.radius
    };
    let [mut lo, mut hi] = [LEAST_DAMPING.ln(), MOST_DAMPING.ln()];
    let mut step = damped(fit, free, left, pull, curvature, LEAST_DAMPING)?;
    if of_radius(&step) <= 1.0 {
        return Some(step);
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (lo + hi);
        step = damped(fit, free, left, pull, curvature, middle.exp())?;
        match of_radius(&step) {
            used if used > 1.0 => lo = middle,
            used if used >= USED => break,
            _ => hi = middle,
        }
    }
    Some(step)
}

/// The step with this share of the curvature as damping.
fn damped(
    fit: &LeastSquares,
    free: &[usize],
    left: &DVector<f64>,
    pull: &DVector<f64>,
    curvature: &DVector<f64>,
    damping: f64,
) -> Option<DVector<f64>> {
    let root = fit.prior.precision.map(f64::sqrt);
    let prior = Diagonal { right: root.component_mul(pull), entries: root };
    let damping = curvature.map(|c| (c * damping).sqrt());
    let damping = Diagonal { entries: damping, right: DVector::zeros(pull.len()) };
    let solved = fit.jacobian.least_squares(free, left, &[prior, damping])?;
    Some(solved.select_rows(free))
}
