//! The standard deviation of the predictions of a fit, row by row.
//!
//! Next file to read: [`crate::screen::screening`].

use nalgebra::DVector;
use starlings_estimators::BlockRow;

use super::fitted_variant::FittedVariant;
use crate::rows::Row;
use crate::run_cache::RunCache;

/// Standard deviation of the prediction of every row by the uncertainty of the fit and of the values that a held-out record has
/// of its own, in the channel's unit; zero where the fit leaves a direction free.
pub(crate) fn prediction_sd(cache: &RunCache<'_>, fit: &FittedVariant<'_>) -> Vec<f64> {
    let Ok(optimum) = fit.optimum() else { return vec![0.0; cache.rows.rows.len()] };
    let mut variance = DVector::zeros(cache.rows.rows.len());
    let (mut jacobian, mut own_values) = (fit.jacobian.in_blocks(&cache.rows), fit.own_values.clone());
    if !cache.rows.is_white() {
        // Row by row a prediction has a standard deviation; its innovations tell of several rows.
        jacobian.for_each_column(|first, values| cache.rows.colour(first, values));
        own_values.column_iter_mut().for_each(|mut of| cache.rows.colour(0, of.as_mut_slice()));
    }
    for BlockRow { rows, columns, values } in jacobian.blocks() {
        let spread = values * optimum.covariance().select_rows(columns).select_columns(columns);
        for (k, i) in rows.clone().enumerate() {
            variance[i] = spread.row(k).dot(&values.row(k)).max(0.0);
        }
    }
    let own = |i: usize| if own_values.is_empty() { 0.0 } else { own_values.row(i).norm_squared() };
    let sd = |(i, row): (usize, &Row)| row.noise * (variance[i] + own(i)).sqrt();
    cache.rows.rows.iter().enumerate().map(sd).collect()
}
