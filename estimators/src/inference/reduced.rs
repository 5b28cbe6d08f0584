//! A model with fewer unknowns than coefficients, fitted to the posterior of the coefficients.
//!
//! θ minimises (ĉ − g(θ))ᵀ Ξ (ĉ − g(θ)), by Gauss and Newton with the damping of Marquardt (1963); under a flat prior the minimum is χ²
//! of as many degrees of freedom as there are coefficients more than unknowns, which tests whether the reduced model can be right.
//! The map g is a formula that costs nothing, so its slopes are central differences. (Smelyanskiy, Luchinsky et al., eqs. 1.73 to
//! 1.82: oscillators behind an unknown mixing matrix.) Read next: `posterior.rs`.

use nalgebra::{DMatrix, DVector};

use super::normal::invert;
use super::{InferenceError, Posterior};
use crate::quantiles::chi_squared_tail;

/// Fall of χ² below which the fit has converged.
const CONVERGED: f64 = 1e-9;
/// Steps at most.
const STEPS: usize = 500;
/// Damping beyond which no step falls.
const STALLED: f64 = 1e12;

/// A reduced model after the data.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Reduced {
    /// θ.
    #[serde(with = "super::text::vector")]
    pub mean: DVector<f64>,
    /// Covariance of θ.
    #[serde(with = "super::text::matrix")]
    pub covariance: DMatrix<f64>,
    /// χ² of the coefficients that the reduced model leaves.
    pub chi_squared: f64,
    /// Coefficients less unknowns.
    pub degrees: usize,
    /// Probability of a larger χ² where the reduced model is right.
    pub probability: f64,
}

/// Fits the unknowns θ of g(θ) = c from a start. `map` gives all active coefficients of the posterior, in their order.
///
/// # Errors
/// `Shape`; `TooFew` coefficients for the unknowns; `Collinear` unknowns, by number; `NotSettled`; `Overflow` where the map is not
/// finite at the start.
pub fn reduce(
    posterior: &Posterior,
    start: &DVector<f64>,
    map: impl Fn(&DVector<f64>) -> DVector<f64>,
) -> Result<Reduced, InferenceError> {
    let (n, k) = (posterior.mean.len(), start.len());
    if n < k {
        let equation = "the reduced model".to_owned();
        return Err(InferenceError::TooFew { n_step: n as u64, n_unknown: k, equation });
    }
    let root = posterior.precision.clone().cholesky();
    let root = root.ok_or(InferenceError::NotDefinite { what: "the posterior's precision" })?.unpack();
    let got = map(start).len();
    if got != n {
        return Err(InferenceError::Shape { what: "coefficients of the reduced model", expected: n, got });
    }
    let fit = Search { whiten: root.transpose(), target: &posterior.mean, map };
    let (mean, slopes, chi_squared) = fit.run(start.clone())?;
    let covariance = invert(&slopes.tr_mul(&slopes), |i| format!("unknown {i}"))?;
    let degrees = n - k;
    let probability = if degrees == 0 { 1.0 } else { chi_squared_tail(chi_squared, degrees as f64) };
    Ok(Reduced { mean, covariance, chi_squared, degrees, probability })
}

struct Search<'a, G> {
    whiten: DMatrix<f64>,
    target: &'a DVector<f64>,
    map: G,
}

impl<G: Fn(&DVector<f64>) -> DVector<f64>> Search<'_, G> {
    /// Whitened differences, and the square of their length.
    fn residual(&self, theta: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
        let residual = &self.whiten * ((self.map)(theta) - self.target);
        let square = residual.norm_squared();
        square.is_finite().then_some((residual, square))
    }

    /// Slopes of the whitened differences.
    fn slopes(&self, theta: &DVector<f64>) -> DMatrix<f64> {
        let columns = (0..theta.len()).map(|j| {
            let step = f64::EPSILON.cbrt() * theta[j].abs().max(1e-3);
            let at = |sign: f64| {
                let mut moved = theta.clone();
                moved[j] += sign * step;
                (self.map)(&moved)
            };
            &self.whiten * (at(1.0) - at(-1.0)) / (2.0 * step)
        });
        DMatrix::from_columns(&columns.collect::<Vec<_>>())
    }

    /// The minimum: θ, slopes there and χ².
    fn run(&self, mut theta: DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>, f64), InferenceError> {
        let overflow = InferenceError::Overflow { what: "the reduced model at its start" };
        let (mut residual, mut square) = self.residual(&theta).ok_or(overflow)?;
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let slopes = self.slopes(&theta);
            let mut fallen = None;
            while fallen.is_none() && damping < STALLED {
                let step = damped(&slopes, &residual, damping);
                let moved = step.map(|step| &theta - step);
                fallen = moved.and_then(|moved| {
                    let (residual, at) = self.residual(&moved)?;
                    (at <= square).then_some((moved, residual, at))
                });
                damping = if fallen.is_some() { (damping * 0.1).max(1e-12) } else { damping * 10.0 };
            }
            let Some((moved, after, at)) = fallen else { return Ok((theta, slopes, square)) };
            let fall = square - at;
            (theta, residual, square) = (moved, after, at);
            if fall <= CONVERGED * (1.0 + square) {
                let slopes = self.slopes(&theta);
                return Ok((theta, slopes, square));
            }
        }
        Err(InferenceError::NotSettled { passes: STEPS })
    }
}

/// (JᵀJ + λ diag JᵀJ)⁻¹ Jᵀ r.
fn damped(slopes: &DMatrix<f64>, residual: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let mut normal = slopes.tr_mul(slopes);
    let least = 1e-12 * normal.diagonal().amax();
    for i in 0..normal.nrows() {
        normal[(i, i)] += damping * normal[(i, i)].max(least);
    }
    let step = normal.cholesky()?.solve(&slopes.tr_mul(residual));
    step.iter().all(|v| v.is_finite()).then_some(step)
}
