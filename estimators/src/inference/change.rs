//! Whether recent steps have the coefficients of earlier ones: a test of two windows with a stated rate of false alarms.
//!
//! With c and Ξ⁻¹ of the reference, recent steps have the score e = w − Ξ' c, whose covariance without a change is Ξ' + Ξ' Ξ⁻¹ Ξ'; its
//! square by that covariance, and a little of the information of as many steps of the reference, is χ², or less, of as many degrees of freedom as the recent steps inform directions (F where the noise was
//! estimated). No coefficient is fitted to the few recent steps. The noise is the reference's. (Rao 1948; Basseville & Nikiforov 1993,
//! section 7.2.) Read next: `detector.rs`, which follows a recording.

use nalgebra::{DMatrix, DVector};

use super::normal::Moments;
use super::{Diffusion, Fit, InferenceError, Posterior, Structure, Sums, diffusion};
use crate::quantiles::{chi_squared_tail, fisher_tail};

/// Pivot of a score's correlation below which a direction is not informed.
const INFORMED: f64 = 1e-8;

/// Share of the information of as many steps of the reference that recent ones are held to have at least. In a stretch shorter than the memory
/// of the states some directions have much less, and a score there is no Gaussian: it goes along with what the noise did (Dickey & Fuller,
/// Journal of the American Statistical Association 1979).
const LITTLE: f64 = 0.03;

/// What recent steps say against the reference.
#[derive(serde::Serialize, serde::Deserialize, Debug, Clone, PartialEq)]
pub struct Change {
    /// Square of the score.
    pub statistic: f64,
    /// Directions that the recent steps inform.
    pub degrees: usize,
    /// Probability of a larger square without a change.
    pub probability: f64,
    /// Score of every watched coefficient that both windows inform, in its sd: (index, score).
    pub scores: Vec<(usize, f64)>,
    /// Coefficients of which the reference knew nothing and the recent steps say something.
    pub appeared: Vec<usize>,
}

/// Compares recent steps with a reference, in the watched coefficients (all where `watched` is empty).
///
/// # Errors
/// `Shape`, `DiffusionNotDefinite`, `Overflow`.
pub fn compare(
    reference: &Posterior,
    recent: &Sums,
    structure: &Structure,
    watched: &[usize],
) -> Result<Change, InferenceError> {
    structure.fits(recent.n_state(), recent.n_function())?;
    let (expected, got) = (structure.n_coefficient(), reference.estimates.len());
    if expected != got {
        return Err(InferenceError::Shape { what: "coefficients of the reference", expected, got });
    }
    let inverse = diffusion::inverse(&reference.diffusion, structure)?;
    let moments = Moments::new(recent, structure);
    let informed = |p: &usize| moments.information(*p, &inverse) > 0.0;
    let appeared = (0..expected).filter(|p| !reference.active.contains(p)).filter(informed).collect();
    let normal = moments.normal(&reference.active, &inverse, true);
    let score = &normal.vector - &normal.precision * &reference.mean;
    let usual = &reference.precision * (recent.n_step() as f64 / reference.n_step.max(1) as f64);
    let covariance =
        &normal.precision + &normal.precision * &reference.covariance * &normal.precision + usual * LITTLE;
    let watches = |p: &usize| (watched.is_empty() || watched.contains(p)) && informed(p);
    let rows: Vec<usize> = (0..reference.active.len()).filter(|i| watches(&reference.active[*i])).collect();
    let score = score.select_rows(&rows);
    let covariance = covariance.select_rows(&rows).select_columns(&rows);
    let sd = covariance.diagonal().map(f64::sqrt);
    let scores = rows.iter().zip(score.iter().zip(&sd)).map(|(i, (e, sd))| (reference.active[*i], e / sd));
    let scores = scores.collect();
    let (statistic, degrees) = square(&score, &covariance, &sd)?;
    let probability = match reference.least_degrees() {
        _ if degrees == 0 => 1.0,
        None => chi_squared_tail(statistic, degrees as f64),
        Some(left) => fisher_tail(statistic / degrees as f64, degrees as f64, left),
    };
    Ok(Change { statistic, degrees, probability, scores, appeared })
}

/// eᵀ A⁺ e and the rank of A, for e in the range of A: Cholesky's factor of the correlation with the largest pivot first (Higham
/// 2002, section 10.3), until the pivots are those of rounding.
fn square(
    score: &DVector<f64>,
    covariance: &DMatrix<f64>,
    sd: &DVector<f64>,
) -> Result<(f64, usize), InferenceError> {
    let mut rest = DMatrix::from_fn(sd.len(), sd.len(), |i, j| covariance[(i, j)] / (sd[i] * sd[j]));
    let mut error = score.component_div(sd);
    let (mut statistic, mut degrees) = (0.0, 0);
    if !rest.iter().chain(&error).all(|v| v.is_finite()) {
        return Err(InferenceError::Overflow { what: "the score of the recent steps" });
    }
    while degrees < sd.len() {
        let pivot = rest.diagonal().imax();
        let size = rest[(pivot, pivot)];
        if size <= INFORMED {
            break;
        }
        let column = rest.column(pivot) / size.sqrt();
        let along = error[pivot] / size.sqrt();
        statistic += along * along;
        degrees += 1;
        error.axpy(-along, &column, 1.0);
        rest.ger(-1.0, &column, &column, 1.0);
    }
    Ok((statistic, degrees))
}

impl Fit {
    /// This fit with the noise of a posterior, for windows too short to have one of their own.
    #[must_use]
    pub fn with_noise_of(&self, posterior: &Posterior) -> Self {
        Self { diffusion: Diffusion::Known(posterior.diffusion.clone()), ..self.clone() }
    }
}
