//! The uncertainty of a held-out record's own values: parameters with one value per record, which no fit estimates for it.
//!
//! Such a record is run with the mean of the fitted records' values, or for an initial value with its own prior median
//! ([`starlings_study::Study::theta_for`]). The uncertainty of that mean is in the Jacobian of [`super::fitted_variant`]. The
//! record's own value deviates from the mean, by as much as the fitted values scatter, or by its prior where only one is
//! fitted. Next file to read: [`super::prediction_sd`].

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use starlings_estimators::BlockRow;
use starlings_study::Study;

use super::fitted_variant::FittedVariant;
use crate::error::ExplainError;
use crate::run_cache::{Point, RunCache};

/// Step of a difference, in prior standard deviations.
const STEP: f64 = 1e-3;

impl FittedVariant<'_> {
    /// Measures what the values that a held-out record has of its own would change, at the best point.
    ///
    /// # Errors
    /// When the fleet or the store fails.
    pub fn measure_own_values(&mut self, cache: &mut RunCache<'_>) -> Result<(), ExplainError> {
        if !self.predicted.is_empty() {
            self.own_values = own_values(cache, self)?;
        }
        Ok(())
    }
}

/// d prediction over the noise for one standard deviation of each value that a held-out record has of its own: rows × values,
/// column k that of the k-th such parameter in the rows of each held-out record. Nothing in the rows of the others.
///
/// # Errors
/// When the fleet or the store fails. A budget that does not suffice for the runs leaves initial values out.
fn own_values(cache: &mut RunCache<'_>, fit: &FittedVariant<'_>) -> Result<DMatrix<f64>, ExplainError> {
    let study = &fit.variant.study;
    let n = cache.rows.rows.len();
    let own: Vec<usize> = (0..study.parameters.len()).filter(|k| study.parameters[*k].per_record).collect();
    let lacks = |r: &usize| own.iter().any(|k| !study.estimates(*r, *k));
    let held_out: Vec<usize> = (0..study.records.len()).filter(lacks).collect();
    if own.is_empty() || held_out.is_empty() {
        return Ok(DMatrix::zeros(n, 0));
    }
    let jacobian = fit.jacobian.in_blocks(&cache.rows);
    let mut values = DMatrix::zeros(n, own.len());
    for record in held_out {
        let rows = cache.rows.of_record(record);
        for (k, &parameter) in own.iter().enumerate().filter(|(_, k)| !study.estimates(record, **k)) {
            let influence = if study.parameters[parameter].is_initial() {
                of_initial(cache, fit, record, parameter)?
            } else {
                let block = jacobian.blocks().iter().find(|block| block.rows == rows);
                block.map(|block| of_mean(block, study, parameter) * scatter(fit, parameter))
            };
            if let Some(influence) = influence {
                values.view_mut((rows.start, k), (rows.len(), 1)).copy_from(&influence);
            }
        }
    }
    Ok(values)
}

/// Positions of the fitted records' values of a parameter in the estimated vector.
fn entries(study: &Study, parameter: usize) -> impl Iterator<Item = usize> + '_ {
    (0..study.theta.len()).filter(move |j| study.theta[*j].parameter == parameter)
}

/// The influence of the mean of the fitted values on a record's rows: all of them move by one prior standard deviation.
fn of_mean(block: &BlockRow, study: &Study, parameter: usize) -> DVector<f64> {
    let none = DVector::zeros(block.values.nrows());
    let of = |place: &usize| study.theta[block.columns[*place]].parameter == parameter;
    (0..block.columns.len()).filter(of).fold(none, |sum, place| sum + block.values.column(place))
}

/// Standard deviation of a further value beside the mean of the fitted ones, in prior standard deviations.
fn scatter(fit: &FittedVariant<'_>, parameter: usize) -> f64 {
    let values: Vec<f64> = entries(&fit.variant.study, parameter).map(|j| fit.z()[j]).collect();
    let n = values.len() as f64;
    if values.len() < 2 {
        return 1.0;
    }
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
}

/// The influence of a held-out record's initial value on its rows, by a run with its prior median moved; nothing where it fails
/// or the budget has ended.
fn of_initial(
    cache: &mut RunCache<'_>,
    fit: &FittedVariant<'_>,
    record: usize,
    parameter: usize,
) -> Result<Option<DVector<f64>>, ExplainError> {
    if !cache.affords_runs(1) {
        cache.cut_short();
        return Ok(None);
    }
    let mut moved = fit.variant.study.clone();
    let of = &mut moved.parameters[parameter];
    of.prior_mean[record] += STEP * of.prior_sd;
    let answer = cache.run(&[Point { study: &moved, theta: fit.theta() }])?.swap_remove(0);
    let (rows, of_record) = (&cache.rows.rows, cache.rows.of_record(record));
    let change = |y: &[f64], i: usize| (y[i] - fit.predicted[i]) / (STEP * rows[i].noise);
    let all = |y: Arc<Vec<f64>>| {
        let first = of_record.start;
        let mut all = DVector::from_iterator(of_record.len(), of_record.map(|i| change(&y, i)));
        cache.rows.whiten(first, all.as_mut_slice());
        all
    };
    Ok(answer.ok().map(all))
}
