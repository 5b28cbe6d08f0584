//! Damped least squares in three bounded unknowns, with derivatives that need not be exact.
//!
//! Levenberg (1944) and Marquardt (1963), scaled by the diagonal. The search stands with the plate, whose modes and dictionary it needs at
//! every step, and a crate of models sees no estimator: hence a small fit here, for three unknowns and without priors, beside the one that
//! asks a fleet for its runs. Next file to read: [`super::search`], which alone uses it.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Steps at most.
const STEPS: usize = 30;
/// Steps in a row that do not lower the cost before the search ends.
const REJECTED: usize = 5;
/// A step that promises or brings less than this of χ² ends the search: 0.01 posterior standard deviations.
const TOLERANCE: f64 = 1e-4;
/// Damping at the start.
const DAMPING: f64 = 1e-3;

/// Bounds of the unknowns.
pub(super) struct Limits {
    pub(super) lowest: [f64; 3],
    pub(super) largest: [f64; 3],
}

/// Where a search ended.
pub(super) struct Minimum {
    pub(super) at: [f64; 3],
    pub(super) residual: DVector<f64>,
    /// Squares of the residual, summed.
    pub(super) cost: f64,
}

/// The point of least squares near `start`. Derivatives (values × 3) are asked for once per accepted step.
pub(super) fn minimise(
    start: [f64; 3],
    limits: &Limits,
    residual: impl Fn(&[f64; 3]) -> DVector<f64>,
    slopes: impl Fn(&[f64; 3]) -> DMatrix<f64>,
) -> Minimum {
    let first = residual(&start);
    let mut best = Minimum { at: start, cost: first.norm_squared(), residual: first };
    let mut jacobian = slopes(&best.at);
    let (mut damping, mut rejected) = (DAMPING, 0);
    for _ in 0..STEPS {
        let Some(step) = step(&jacobian, &best.residual, damping) else { break };
        let at = std::array::from_fn(|i| (best.at[i] + step[i]).clamp(limits.lowest[i], limits.largest[i]));
        let tried = residual(&at);
        let cost = tried.norm_squared();
        if cost < best.cost {
            let fell = best.cost - cost;
            best = Minimum { at, residual: tried, cost };
            if fell < TOLERANCE {
                break;
            }
            jacobian = slopes(&best.at);
            (damping, rejected) = (0.1 * damping, 0);
        } else {
            (damping, rejected) = (10.0 * damping, rejected + 1);
            let promised = (&jacobian * DVector::from_column_slice(step.as_slice())).norm_squared();
            if rejected == REJECTED || promised < TOLERANCE {
                break;
            }
        }
    }
    best
}

/// −(JᵀJ + λ diag JᵀJ)⁻¹ Jᵀ r.
fn step(jacobian: &DMatrix<f64>, residual: &DVector<f64>, damping: f64) -> Option<Vector3<f64>> {
    let mut information = Matrix3::from_iterator(jacobian.tr_mul(jacobian).iter().copied());
    let slope = Vector3::from_iterator(jacobian.tr_mul(residual).iter().copied());
    for i in 0..3 {
        information[(i, i)] *= 1.0 + damping;
    }
    Some(-information.cholesky()?.solve(&slope))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: Limits = Limits { lowest: [-100.0; 3], largest: [100.0; 3] };

    /// Residuals of y = a e^(b t) + c at ten times.
    fn residual(p: &[f64; 3]) -> DVector<f64> {
        let value = |p: &[f64; 3], t: f64| p[0] * (p[1] * t).exp() + p[2];
        DVector::from_fn(10, |i, _| {
            1e3 * (value(p, 0.1 * i as f64) - value(&[2.0, -1.5, 0.3], 0.1 * i as f64))
        })
    }

    fn slopes(p: &[f64; 3], scale: f64) -> DMatrix<f64> {
        let t = |i: usize| 0.1 * i as f64;
        DMatrix::from_fn(10, 3, |i, j| {
            let e = (p[1] * t(i)).exp();
            1e3 * scale * [e, p[0] * t(i) * e, 1.0][j]
        })
    }

    #[test]
    fn the_minimum_is_found_with_exact_derivatives_and_with_some_that_are_a_tenth_off() {
        for scale in [1.0, 1.1, 0.9] {
            let end = minimise([1.0, -1.0, 0.0], &FREE, residual, |p| slopes(p, scale));
            // A cost of 1e-4 is 1e-5 in values of about one.
            assert!(end.cost < 1e-4, "{scale}: {}", end.cost);
            assert!((end.at[1] + 1.5).abs() < 1e-3, "{:?}", end.at);
        }
    }

    #[test]
    fn a_bound_is_not_crossed() {
        let limits = Limits { lowest: [0.0, -1.2, 0.0], ..FREE };
        let end = minimise([1.0, -1.0, 0.1], &limits, residual, |p| slopes(p, 1.0));
        assert!(end.at[1] >= -1.2 && end.cost > 1.0, "{:?}", end.at);
    }
}
