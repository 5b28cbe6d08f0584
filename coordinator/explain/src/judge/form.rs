//! Whether an effect has the right form: whether candidates or modulated forms of it would still lower χ² beyond chance.
//!
//! All candidates and the modulated forms of the effect (`refit/modulated_forms.rs`; "bent forms" in the output) are added to the
//! fit one after the other, to first order, and judged by what that predicts of the held-out rows. After an effect that only
//! resembles the missing one they lower χ² again in data that no fit has seen. After the right effect, noise and disturbances of
//! another kind remain, on which they do not. Next file to read: [`super::gates`].

mod column;

use nalgebra::DVector;
use starlings_estimators::noise_from_third_differences;
use starlings_estimators::quantiles::squared_t_as_improbable;

use self::column::{Column, Columns};
use super::adequacy::AS_STATED;
use super::effective_noise::{inflation, training_stretches};
use super::uncertainty::Uncertainty;
use crate::error::ExplainError;
use crate::fit::fitted_variant::FittedVariant;
use crate::rows::{Rows, Usage};
use crate::run_cache::RunCache;
use crate::screen::screening_result::ScreeningResult;

/// Columns that are combined at most.
const MOST: usize = 3;
/// Least fall of χ² by the first column, in units of the effective noise ...
const FIRST: f64 = 12.0;
/// ... and by each further one.
const FURTHER: f64 = 8.0;
/// Least share of the χ² above the noise that the columns must take away; of a discrepancy of another kind they take less.
const RESOLVED: f64 = 0.5;
/// Least gain per held-out row, as a share of the gain per training row.
const RECURRENCE: f64 = 0.15;

/// The fall of χ² that candidates and modulated forms would still bring.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Leftover {
    /// Fall of χ² of the training rows, in units of the effective noise.
    pub gain: f64,
    /// Fall of χ² of the held-out rows that they bring, beyond the uncertainty of the estimate, in the same units.
    pub gain_held_out: f64,
    /// Share of the χ² above the noise that they take away.
    pub share: f64,
    /// Whether this is more than chance, so that the form of the effect is not right.
    pub is_systematic: bool,
    /// Largest fall of χ² that a fully modulated form would bring if it were the truth, in units of the effective noise; small
    /// where the data cannot tell one form from another.
    pub power: f64,
}

/// The screening at a fit for the check of its form.
pub(crate) struct Measured<'h> {
    /// The candidates.
    pub library: &'h [ScreeningResult],
    /// The modulated forms of the effect.
    pub modulated: &'h [ScreeningResult],
    /// Unknown constants in the equations.
    pub constants: &'h [ScreeningResult],
}

/// Adds the columns one after the other to a fit, to first order.
///
/// # Errors
/// When the fit leaves a direction free.
pub(crate) fn leftover(
    cache: &RunCache<'_>,
    fit: &FittedVariant<'_>,
    measured: &Measured<'_>,
) -> Result<Leftover, ExplainError> {
    let optimum = fit.optimum()?;
    let rows = &cache.rows;
    let is_usable = |h: &&ScreeningResult| h.failure.is_none() && !h.is_absorbed();
    let all =
        [measured.library, measured.modulated, measured.constants].into_iter().flatten().filter(is_usable);
    let columns = Columns::new(cache, fit, &optimum, all.collect())?;
    // Held-out channels count as well, since the right form must serve them too.
    let held: Vec<usize> = (0..rows.rows.len()).filter(|i| rows.rows[*i].usage != Usage::Train).collect();
    // A modulated form of amplitude one is the term itself times a signal between -1 and 1. One that the parameters imitate tells
    // nothing of the form.
    let mut power = 0.0_f64;
    for result in measured.modulated.iter().filter(is_usable) {
        power = power.max(optimum.unimitated(&result.influence.of_train(cache)?).norm_squared());
    }
    let (noise, chance) = effective(rows, fit.residual(), fit.variant.n_param());
    let power = power / (noise * chance);
    let mut left = Leftover { power, ..Leftover::default() };
    let floor = noise_floor(rows, fit.residual());
    let mut residual = optimum.residual().clone();
    let mut correction = DVector::zeros(rows.rows.len());
    let whitened = rows.whitened(&fit.predicted);
    // What the uncertainty of the estimate explains of the held-out errors says nothing of the form.
    let uncertainty = Uncertainty::of(cache, fit);
    let beyond = |errors: &[f64]| {
        let explained = uncertainty.as_ref().map_or(0.0, |of| of.allowance(&held, errors));
        held.iter().map(|i| errors[*i].powi(2)).sum::<f64>() - explained
    };
    let before = beyond(&whitened);
    let mut taken: Vec<Column> = Vec::new();
    for n_column in 1..=MOST.min(columns.len()) {
        let Some(best) = columns.nearest(&residual, &taken)? else { break };
        let amplitude = best.own.dot(&residual);
        residual -= &best.own * amplitude;
        correction += &best.all * amplitude;
        taken.push(best);
        // The noise is that of the residuals without the columns taken so far.
        let without = residual.rows(0, rows.train.len()).into_owned();
        let (noise, chance) = effective(rows, &without, fit.variant.n_param() + n_column);
        let corrected: Vec<f64> = whitened.iter().zip(&correction).map(|(e, c)| e - c).collect();
        let gain = (optimum.residual().norm_squared() - residual.norm_squared()) / noise;
        let gain_held_out = (before - beyond(&corrected)) / noise;
        let wanted = RECURRENCE * gain * held.len() as f64 / rows.train.len().max(1) as f64;
        let above = |e: &DVector<f64>| e.norm_squared() - floor;
        // Where the residuals do not exceed the noise, the quotient is not defined and its bounds stand for it.
        let share =
            (1.0 - above(&residual) / above(optimum.residual()).max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0);
        let is_systematic = gain > chance * (FIRST + FURTHER * (n_column - 1) as f64)
            && (held.is_empty() || gain_held_out > wanted)
            && share > RESOLVED;
        if n_column == 1 || (is_systematic && !left.is_systematic) {
            left = Leftover { gain, gain_held_out, share, is_systematic, power };
        }
    }
    Ok(left)
}

/// The effective noise of training residuals, and by what factor a fall of χ² must be larger where they alone tell it, less what was
/// fitted to them: where the noise was found, or is larger than stated. Their correlation makes them no fewer here: few enough would refuse
/// no form.
fn effective(rows: &Rows, residual: &DVector<f64>, n_fitted: usize) -> (f64, f64) {
    let (n, inflation) = (residual.len() as f64, inflation(rows, residual));
    let is_known = rows.noise_freedom(|row| row.usage == Usage::Train).is_infinite();
    if is_known && residual.norm_squared() <= AS_STATED[1] * n {
        return (inflation, 1.0);
    }
    let freedom = n - n_fitted as f64;
    (inflation * n / freedom.max(1.0), squared_t_as_improbable(FIRST, freedom) / FIRST)
}

/// χ² of the white part of the residuals, at most that of the stated noise, from their third differences.
fn noise_floor(rows: &Rows, residual: &DVector<f64>) -> f64 {
    let of = |stretch: std::ops::Range<usize>| {
        let values = &residual.as_slice()[stretch];
        let sd = noise_from_third_differences(values);
        let variance = if sd.is_finite() { (sd * sd).min(1.0) } else { 1.0 };
        variance * values.len() as f64
    };
    training_stretches(rows).into_iter().map(of).sum()
}

/// Variance of the white part of the residuals over that of the stated noise, at most one, from their third differences.
pub(crate) fn white_noise(rows: &Rows, residual: &DVector<f64>) -> f64 {
    noise_floor(rows, residual) / (residual.len().max(1) as f64)
}

/// Share of the residuals' squares that white noise makes, from their third differences.
pub(crate) fn white_share(rows: &Rows, residual: &DVector<f64>) -> f64 {
    noise_floor(rows, residual) / residual.norm_squared().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::white;

    #[test]
    fn a_fall_must_be_larger_where_few_residuals_alone_tell_the_noise() {
        let mut rows = Rows::sample(31, |_| Usage::Train);
        let residual = white(31, 1);
        let stated = effective(&rows, &residual, 4);
        assert_eq!(stated, (inflation(&rows, &residual), 1.0));
        rows.rows.iter_mut().for_each(|row| row.noise_freedom = 5.9);
        let (noise, chance) = effective(&rows, &residual, 4);
        // Student's t with 27 degrees of freedom: 15.45 for 12.
        assert!((noise / stated.0 - 31.0 / 27.0).abs() < 1e-12 && (FIRST * chance - 15.447).abs() < 1e-3);
        assert!(effective(&rows, &residual, 31).1.is_infinite(), "as many fitted as there are");
    }
}
