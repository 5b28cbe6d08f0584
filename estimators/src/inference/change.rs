//! Whether recent steps have the coefficients of earlier ones: a test of two windows with a stated rate of false alarms.
//!
//! With c and Ξ⁻¹ of the reference, recent steps have the score e = w − Ξ' c, whose covariance without a change is Ξ' + Ξ' Ξ⁻¹ Ξ'; its
//! square by that covariance is χ² of as many degrees of freedom as the recent steps inform directions (F where the noise was
//! estimated). No coefficient is fitted to the few recent steps. The noise is the reference's. (Rao 1948; Basseville & Nikiforov 1993,
//! section 7.2.) Read next: `detector.rs`, which follows a recording.

use nalgebra::{DMatrix, DVector};

use super::normal::Moments;
use super::quantiles::{chi_squared_tail, fisher_tail};
use super::{Diffusion, Fit, InferenceError, Posterior, Structure, Sums, diffusion};
use crate::spectral;

/// Share of the largest eigenvalue of a score's correlation below which a direction is not informed.
const INFORMED: f64 = 1e-8;

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

impl Change {
    /// Whether it is an alarm when one test in 1/`rate` may be a false one. Of m tests, also of overlapping windows, at most m
    /// `rate` false alarms are expected.
    pub fn is_alarm(&self, rate: f64) -> bool {
        self.probability < rate
    }
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
    let covariance = &normal.precision + &normal.precision * &reference.covariance * &normal.precision;
    let watches = |p: &usize| (watched.is_empty() || watched.contains(p)) && informed(p);
    let rows: Vec<usize> = (0..reference.active.len()).filter(|i| watches(&reference.active[*i])).collect();
    let score = score.select_rows(&rows);
    let covariance = covariance.select_rows(&rows).select_columns(&rows);
    let sd = covariance.diagonal().map(f64::sqrt);
    let scores = rows.iter().zip(score.iter().zip(&sd)).map(|(i, (e, sd))| (reference.active[*i], e / sd));
    let scores = scores.collect();
    let (statistic, degrees) = square(&score, &covariance, &sd)?;
    let probability = match reference.degrees {
        _ if degrees == 0 => 1.0,
        None => chi_squared_tail(statistic, degrees as f64),
        Some(left) => fisher_tail(statistic / degrees as f64, degrees as f64, left),
    };
    Ok(Change { statistic, degrees, probability, scores, appeared })
}

/// eᵀ A⁺ e and the rank of A.
fn square(
    score: &DVector<f64>,
    covariance: &DMatrix<f64>,
    sd: &DVector<f64>,
) -> Result<(f64, usize), InferenceError> {
    if score.is_empty() {
        return Ok((0.0, 0));
    }
    let overflow = InferenceError::Overflow { what: "the score of the recent steps" };
    let scale = DMatrix::from_diagonal(&sd.map(|sd| 1.0 / sd));
    let eigen = spectral::eigen(&scale * covariance * &scale, "correlation of the score")
        .map_err(|_| overflow.clone())?;
    let along = eigen.eigenvectors.tr_mul(&(scale * score));
    let least = INFORMED * eigen.eigenvalues.amax();
    let informed = along.iter().zip(&eigen.eigenvalues).filter(|(_, value)| **value > least);
    let squares: Vec<f64> = informed.map(|(along, value)| along * along / value).collect();
    let statistic: f64 = squares.iter().sum();
    if statistic.is_finite() { Ok((statistic, squares.len())) } else { Err(overflow) }
}

impl Fit {
    /// This fit with the noise of a posterior, for windows too short to have one of their own.
    #[must_use]
    pub fn with_noise_of(&self, posterior: &Posterior) -> Self {
        Self { diffusion: Diffusion::Known(posterior.diffusion.clone()), ..self.clone() }
    }
}
