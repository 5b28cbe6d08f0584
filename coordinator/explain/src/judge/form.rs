//! Whether what is left after an effect is still of the library's making: then the effect has the wrong form.
//!
//! All candidates and the bent forms of the effect ([`crate::refit::modulated_forms`]) are added to the fit one after the other, to first order, and judged by what
//! that predicts of the held-out rows. A relative of the missing effect leaves something that they can still take away, and that comes again
//! in data which no fit has seen; noise and disturbances of another kind do not. Next file to read: [`crate::refit::search`].

mod column;

use nalgebra::DVector;
use starlings_estimators::noise_from_third_differences;

use self::column::{Column, Columns};
use super::effective_noise::{inflation, training_stretches};
use crate::error::ExplainError;
use crate::fit::fitted_variant::FittedVariant;
use crate::rows::{Rows, Usage};
use crate::run_cache::RunCache;
use crate::screen::screening_result::ScreeningResult;

/// Columns that are combined at most.
const MOST: usize = 3;
/// A first column must take away this much of χ², in units of the effective noise ...
const FIRST: f64 = 12.0;
/// ... and each further one this much.
const FURTHER: f64 = 8.0;
/// Share of what is left above the noise that they must take away: of a discrepancy of another kind they take only a part.
const RESOLVED: f64 = 0.5;
/// Share of the gain on the training rows that must come again, per row, on the held-out rows.
const AGAIN: f64 = 0.15;

/// What candidates and bent forms could still take away.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Leftover {
    /// Fall of χ² of the training rows, in units of the effective noise.
    pub gain: f64,
    /// Fall of χ² of the held-out rows that they bring, in the same units.
    pub gain_held_out: f64,
    /// Share of what is left above the noise that they take away.
    pub share: f64,
    /// Whether there is something left that the library, or a bent form of the effect, can take away.
    pub is_systematic: bool,
    /// Largest fall of χ² that a fully bent form would bring if it were the truth, in units of the effective noise; small
    /// where the data do not tell forms.
    pub power: f64,
}

/// What was measured at a fit for the check of its form.
pub(crate) struct Measured<'h> {
    /// The candidates.
    pub library: &'h [ScreeningResult],
    /// The bent forms of the effect.
    pub modulated: &'h [ScreeningResult],
    /// Unknown constants in the equations.
    pub constants: &'h [ScreeningResult],
}

/// Looks at the residuals of a fit with the sensitivities that were measured there.
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
    // Held-out channels count as well: a better form must serve them too.
    let held: Vec<usize> = (0..rows.rows.len()).filter(|i| rows.rows[*i].usage != Usage::Train).collect();
    // A bent form at amplitude one is the term itself times a signal between -1 and 1. One that the parameters imitate tells
    // nothing of the form.
    let mut power = 0.0_f64;
    for result in measured.modulated.iter().filter(is_usable) {
        power = power.max(optimum.unimitated(&result.influence.of_train(cache)?).norm_squared());
    }
    let power = power / inflation(rows, fit.residual());
    let mut left = Leftover { power, ..Leftover::default() };
    let floor = noise_floor(rows, fit.residual());
    let mut residual = optimum.residual().clone();
    let mut correction = DVector::zeros(rows.rows.len());
    let whitened = rows.whitened(&fit.predicted);
    let mut taken: Vec<Column> = Vec::new();
    for n_column in 1..=MOST.min(columns.len()) {
        let Some(best) = columns.nearest(&residual, &taken)? else { break };
        let amplitude = best.own.dot(&residual);
        residual -= &best.own * amplitude;
        correction += &best.all * amplitude;
        taken.push(best);
        // What remains when it was taken away tells the noise that it is judged by.
        let noise = inflation(rows, &residual.rows(0, rows.train.len()).into_owned());
        let fall = |i: &usize| whitened[*i].powi(2) - (whitened[*i] - correction[*i]).powi(2);
        let gain = (optimum.residual().norm_squared() - residual.norm_squared()) / noise;
        let gain_held_out = held.iter().map(fall).sum::<f64>() / noise;
        let wanted = AGAIN * gain * held.len() as f64 / rows.train.len().max(1) as f64;
        let above = |e: &DVector<f64>| e.norm_squared() - floor;
        // Where nothing stands above the noise there is nothing to share out, and the quotient has no size.
        let share =
            (1.0 - above(&residual) / above(optimum.residual()).max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0);
        let is_systematic = gain > FIRST + FURTHER * (n_column - 1) as f64
            && (held.is_empty() || gain_held_out > wanted)
            && share > RESOLVED;
        if n_column == 1 || (is_systematic && !left.is_systematic) {
            left = Leftover { gain, gain_held_out, share, is_systematic, power };
        }
    }
    Ok(left)
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

/// Share of the residuals' squares that white noise makes, from their third differences.
pub(crate) fn white_share(rows: &Rows, residual: &DVector<f64>) -> f64 {
    noise_floor(rows, residual) / residual.norm_squared().max(f64::MIN_POSITIVE)
}
