//! Whether the steps of a recording are coarse for the dynamics that was found: what the extrapolation to no step would move a coefficient
//! by, on pieces of the recording, beside the interval of that coefficient.
//!
//! The pieces have sums at h, 2h and 4h (`decimation.rs`); how well they know the move is told by the jackknife over them (Tukey, Annals of
//! Mathematical Statistics 1958). Where 4h has no fit, h and 2h are compared, whose difference is at most three times the error at h, for
//! the error falls with the square of the step at most. Where 2h has none either, the fitted drift itself says how far it goes in a step: at
//! mid-points a rate λ comes out as (2/h) tanh(λh/2), too small by (λh)²/12 of itself. Read next: `decimation.rs`, which takes the error out.

use nalgebra::{DMatrix, DVector};

use super::{Diffusion, Fit, InferenceError, Posterior, Strength, Structure, Sums, extrapolate};
use crate::quantiles::student;

/// Probability with which any coefficient is told to move that does not.
const FALSE_ALARM: f64 = 0.01;

/// What a coefficient would move by without the error of the step.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct StepError {
    /// Its name.
    pub name: String,
    /// What the extrapolation to no step adds to it.
    pub moves: f64,
    /// Standard error of that; zero where it was computed from the drift that was found.
    pub sd: f64,
    /// Half-width of its interval, which the error of the step is not in.
    pub half: f64,
}

/// The coefficients that the error of the step moves out of their intervals of probability `level`, and surely so. `pieces` are sums at h, 2h
/// and 4h of parts of the recording, of which the first `n_level` are compared, three or two; `posterior` is that of all of it.
///
/// # Errors
/// `Shape` for fewer than two pieces or other than two or three steps; as [`Fit::posterior`] and [`extrapolate`] at any of them.
pub fn step_errors(
    pieces: &[[Sums; 3]],
    n_level: usize,
    fit: &Fit,
    structure: &Structure,
    posterior: &Posterior,
    level: f64,
) -> Result<Vec<StepError>, InferenceError> {
    let n = pieces.len();
    if n < 2 {
        return Err(InferenceError::Shape { what: "pieces of a recording", expected: 2, got: n });
    }
    if !(2..=3).contains(&n_level) {
        return Err(InferenceError::Shape { what: "steps to compare", expected: 3, got: n_level });
    }
    let at = |k: usize| fit.posterior(&merged(pieces, k, None)?, structure);
    let levels = (0..n_level).map(at).collect::<Result<Vec<_>, _>>()?;
    let found = extrapolate(&levels, (n_level == 2).then_some(Strength::Weak))?;
    let mut without = Vec::with_capacity(n);
    for left_out in 0..n {
        let known = |k: usize| {
            let diffusion = Diffusion::Known(levels[k].diffusion.clone());
            let fit = Fit { diffusion, lag_corrected: false, ..fit.clone() };
            fit.posterior(&merged(pieces, k, Some(left_out))?, structure)
        };
        let (fine, coarse) = (known(0)?, known(1)?);
        if fine.active() != levels[0].active() || coarse.active() != levels[0].active() {
            return Err(InferenceError::Incompatible { what: "the coefficients that they hold" });
        }
        without.push((fine.mean() - coarse.mean()) / share(found.used));
    }
    let sd = jackknife(&without);
    let active = levels[0].active();
    let sure = student(1.0 - 0.5 * FALSE_ALARM / active.len().max(1) as f64, Some((n - 1) as f64));
    let moved = active.iter().enumerate().filter_map(|(i, p)| {
        let moves = found.estimates[*p].value?.mean - levels[0].mean()[i];
        let [lo, hi] = posterior.interval(*p, level)?;
        let half = 0.5 * (hi - lo);
        let name = posterior.estimates[*p].name.clone();
        (moves.abs() > half && moves.abs() > sure * sd[i]).then_some(StepError {
            name,
            moves,
            sd: sd[i],
            half,
        })
    });
    Ok(moved.collect())
}

/// The coefficients that noise and a coarse step move out of their intervals of probability `level` together: ½ D V Φ⁻¹ is the first order in
/// h div f of the Jacobian log|I − ½hJ|, whose slope in a coefficient is −½h tr((I − ½hJ)⁻¹ ∂J). Taken whole at the mean Jacobian, over all
/// of the recording. A first-order error, where that of a path without noise is of second order.
pub fn noise_errors(sums: &Sums, structure: &Structure, posterior: &Posterior, level: f64) -> Vec<StepError> {
    let n = sums.n_state();
    let half_step = 0.5 * sums.step();
    let jacobian = posterior.drift() * sums.v().transpose() / sums.n_step().max(1) as f64;
    let Some(whole) = (DMatrix::identity(n, n) - jacobian * half_step).try_inverse() else {
        return Vec::new();
    };
    let missed = whole.transpose() * sums.v() - sums.v();
    let score = |p: &usize| {
        let places = structure.coefficients()[*p].places.iter();
        -half_step * places.map(|a| a.factor * missed[(a.equation, a.function)]).sum::<f64>()
    };
    let active = posterior.active();
    let moves = posterior.covariance() * DVector::from_iterator(active.len(), active.iter().map(score));
    let moved = active.iter().zip(&moves).filter_map(|(p, moves)| {
        let [lo, hi] = posterior.interval(*p, level)?;
        let (half, estimate) = (0.5 * (hi - lo), &posterior.estimates[*p]);
        (moves.abs() > half).then(|| StepError { name: estimate.name.clone(), moves: *moves, sd: 0.0, half })
    });
    moved.collect()
}

/// Step times the spectral radius of the mean Jacobian of a fitted drift: how many times its fastest time a step is. Functions at the left
/// point have no slopes and count as constant.
pub fn step_in_rates(sums: &Sums, posterior: &Posterior) -> f64 {
    let jacobian: DMatrix<f64> = posterior.drift() * sums.v().transpose() / sums.n_step().max(1) as f64;
    let largest = jacobian.complex_eigenvalues().iter().map(|value| value.norm()).fold(0.0, f64::max);
    sums.step() * largest
}

/// Change from 2h to h over what is left to no step.
fn share(used: Strength) -> f64 {
    match used {
        Strength::Weak => 3.0,
        Strength::Strong => 1.0,
    }
}

/// The sums of all pieces but one, at one of the steps.
fn merged(pieces: &[[Sums; 3]], level: usize, left_out: Option<usize>) -> Result<Sums, InferenceError> {
    let mut kept =
        pieces.iter().enumerate().filter(|(k, _)| Some(*k) != left_out).map(|(_, piece)| &piece[level]);
    let first = kept.next().cloned();
    let Some(mut whole) = first.map(Sums::detach) else {
        return Err(InferenceError::Shape { what: "pieces of a recording", expected: 2, got: 1 });
    };
    for piece in kept {
        whole = whole.detach();
        whole.merge(piece)?;
    }
    Ok(whole)
}

/// Standard errors from estimates that leave out one piece each.
fn jackknife(without: &[DVector<f64>]) -> DVector<f64> {
    let n = without.len() as f64;
    let mean = without.iter().sum::<DVector<f64>>() / n;
    let squares = without.iter().map(|one| (one - &mean).map(|v| v * v)).sum::<DVector<f64>>();
    squares.map(|sum| (sum * (n - 1.0) / n).sqrt())
}
