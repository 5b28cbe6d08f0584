//! Whether what is left after an effect is still of the library's making: then the effect has the wrong form.
//!
//! All candidates together are fitted to the residuals of the training rows, to first order, and judged by what that predicts
//! of the held-out rows. A relative of the missing effect leaves something that they can still take away, and that comes again
//! in data which no fit has seen; noise and disturbances of another kind do not. Next file to read: [`super::search`].

use nalgebra::{DMatrix, DVector};

use super::ExplainError;
use super::fit::Fitted;
use super::laboratory::Laboratory;
use super::rows::Usage;
use super::screen::Hit;

/// Directions with less of the sensitivities' information than this are left out.
const SMALLEST: f64 = 1e-3;
/// A direction counts when it takes away this much of χ², in units of the effective noise.
const COUNTS: f64 = 6.0;

/// What all candidates together could still take away.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Leftover {
    /// Fall of χ² of the training rows, in units of the effective noise.
    pub gain: f64,
    /// Directions that make it.
    pub n_direction: usize,
    /// Fall of χ² of the held-out rows that these directions bring, in the same units.
    pub gain_held_out: f64,
    /// Whether there are held-out rows.
    pub has_held_out: bool,
}

impl Leftover {
    /// Whether there is something left that the library can take away.
    pub fn is_systematic(&self) -> bool {
        let beyond = self.gain > 12.0 + 6.0 * (self.n_direction as f64 - 1.0).max(0.0);
        beyond && (!self.has_held_out || self.gain_held_out > 0.1 * self.gain)
    }
}

/// Looks at the residuals of a fit with the sensitivities that were measured there.
///
/// # Errors
/// When the fit leaves a direction free.
pub fn leftover(
    laboratory: &Laboratory<'_>,
    fit: &Fitted<'_>,
    hits: &[Hit],
    inflation: f64,
) -> Result<Leftover, ExplainError> {
    let optimum = fit.optimum()?;
    let rows = &laboratory.rows;
    let train_jacobian_free = |s: &DVector<f64>| {
        let of_train = s.select_rows(&rows.train);
        (optimum.unimitated(&of_train), s - &fit.jacobian * optimum.response(&of_train))
    };
    let usable = hits.iter().filter(|h| h.failure.is_none() && !h.is_absorbed());
    let (mut own, mut all) = (Vec::new(), Vec::new());
    for hit in usable {
        let (train, whole) = train_jacobian_free(&hit.sensitivity);
        let size = train.norm();
        if size > 0.0 {
            own.push(train / size);
            all.push(whole / size);
        }
    }
    let held: Vec<usize> =
        (0..rows.rows.len()).filter(|i| rows.rows[*i].usage == Usage::HeldOut).collect();
    let mut left = Leftover { has_held_out: !held.is_empty(), ..Leftover::default() };
    if own.is_empty() {
        return Ok(left);
    }
    let (own, all) = (DMatrix::from_columns(&own), DMatrix::from_columns(&all));
    let eigen = own.tr_mul(&own).symmetric_eigen();
    let along = eigen.eigenvectors.tr_mul(&own.tr_mul(optimum.residual()));
    let mut coefficients = DVector::zeros(own.ncols());
    for (k, value) in eigen.eigenvalues.iter().enumerate().filter(|(_, v)| **v > SMALLEST) {
        let gain = along[k] * along[k] / value / inflation;
        if gain > COUNTS {
            left.gain += gain;
            left.n_direction += 1;
            coefficients += eigen.eigenvectors.column(k) * (along[k] / value);
        }
    }
    let correction = all * coefficients;
    let whitened = rows.whitened(&fit.predicted);
    let fall = |i: &usize| whitened[*i].powi(2) - (whitened[*i] - correction[*i]).powi(2);
    left.gain_held_out = held.iter().map(fall).sum::<f64>() / inflation;
    Ok(left)
}
