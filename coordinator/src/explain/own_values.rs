//! What is not known of a record that no fit sees: the values that it has of its own.
//!
//! Such a record is run with the mean of the fitted records, or for an initial value with its own prior median
//! ([`crate::study::Study::theta_for`]). That mean depends on what was fitted, which the Jacobian of [`super::fit`] holds. The
//! record's own value lies beside it: by the scatter of the fitted ones, or where there is only one by the prior. Next file to
//! read: [`super::held_out`].

use nalgebra::{DMatrix, DVector};

use super::ExplainError;
use super::fit::Fitted;
use super::laboratory::{Laboratory, Point};
use crate::study::Study;

/// Distance of a difference, in prior standard deviations.
const STEP: f64 = 1e-3;

/// d prediction over the noise for one standard deviation of each value that a held-out record has of its own: rows × values.
///
/// # Errors
/// When the fleet or the store fails. A budget that does not suffice for the runs leaves initial values out.
pub(super) fn own_values(
    laboratory: &mut Laboratory<'_>,
    fit: &Fitted<'_>,
) -> Result<DMatrix<f64>, ExplainError> {
    let study = &fit.version.study;
    let n = laboratory.rows.rows.len();
    let mut columns = Vec::new();
    for record in (0..study.records.len()).filter(|r| !study.records[*r].is_trained()) {
        for parameter in (0..study.parameters.len()).filter(|k| study.parameters[*k].per_record) {
            let influence = if study.parameters[parameter].is_initial() {
                of_initial(laboratory, fit, record, parameter)?
            } else {
                (!fit.jacobian.is_empty())
                    .then(|| of_mean(laboratory, fit, parameter) * scatter(fit, parameter))
            };
            columns.extend(influence.map(|all| only(laboratory, &all, record)));
        }
    }
    Ok(if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) })
}

/// Positions of the fitted records' values of a parameter in the estimated vector.
fn entries(study: &Study, parameter: usize) -> impl Iterator<Item = usize> + '_ {
    (0..study.theta.len()).filter(move |j| study.theta[*j].parameter == parameter)
}

/// The influence of the mean of the fitted values: all of them move by one prior standard deviation.
fn of_mean(laboratory: &Laboratory<'_>, fit: &Fitted<'_>, parameter: usize) -> DVector<f64> {
    let jacobian = fit.jacobian.whole(&laboratory.rows);
    let none = DVector::zeros(jacobian.nrows());
    entries(&fit.version.study, parameter).fold(none, |sum, j| sum + jacobian.column(j))
}

/// Standard deviation of a further value beside the mean of the fitted ones, in prior standard deviations.
fn scatter(fit: &Fitted<'_>, parameter: usize) -> f64 {
    let values: Vec<f64> = entries(&fit.version.study, parameter).map(|j| fit.z()[j]).collect();
    let n = values.len() as f64;
    if values.len() < 2 {
        return 1.0;
    }
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
}

/// The influence of a held-out record's initial value, by a run with its prior median moved; nothing where it fails or the budget
/// has ended.
fn of_initial(
    laboratory: &mut Laboratory<'_>,
    fit: &Fitted<'_>,
    record: usize,
    parameter: usize,
) -> Result<Option<DVector<f64>>, ExplainError> {
    if !laboratory.affords_runs(1) {
        laboratory.cut_short();
        return Ok(None);
    }
    let mut moved = fit.version.study.clone();
    let of = &mut moved.parameters[parameter];
    of.prior_mean[record] += STEP * of.prior_sd;
    let answer = laboratory.run(&[Point { study: &moved, theta: fit.theta() }])?.swap_remove(0);
    let rows = &laboratory.rows.rows;
    let change =
        |y: &[f64]| DVector::from_fn(rows.len(), |i, _| (y[i] - fit.predicted[i]) / (STEP * rows[i].noise));
    Ok(answer.ok().map(|y| change(&y)))
}

/// The part of an influence that lies in one record.
fn only(laboratory: &Laboratory<'_>, influence: &DVector<f64>, record: usize) -> DVector<f64> {
    let of_row = |i: usize| if laboratory.rows.rows[i].record == record { influence[i] } else { 0.0 };
    DVector::from_fn(influence.len(), |i, _| of_row(i))
}
