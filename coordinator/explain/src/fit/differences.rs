//! The Jacobian of a fit by finite differences: one run per parameter of the study and record.
//!
//! A parameter with one value per record is moved in all records at once, and each record answers to its own; a held-out record
//! is run with their mean and answers to each of them. Next file to read: [`super::drive`].

use std::sync::Arc;

use nalgebra::DVector;
use starlings_estimators::BlockAngular;

use super::fitted_variant::{FittedVariant, point};
use super::jacobian::record_blocks;
use crate::error::ExplainError;
use crate::run_cache::{Point, RowPredictions, RunCache};

/// Longest step of the differences, in z ...
const STEP: f64 = 1e-3;
/// ... and the change of the residuals, root mean square, beyond which it is shorter: an error of the derivative along what the data feel
/// most would bend the steps along what they hardly feel.
const CHANGE: f64 = 0.3;
/// Shortest step over the longest: the digits of an integration.
const SHORTEST: f64 = 1e-2;
/// Longest move of an instant, in z: where it is at an end of its range a sampling interval is far.
const FARTHEST: f64 = 0.1;

impl FittedVariant<'_> {
    /// The step of every parameter of the study, by what the last Jacobian says of it.
    pub(crate) fn steps(&self, z: &DVector<f64>) -> Vec<f64> {
        let study = &self.variant.study;
        let mut steps = vec![STEP; study.parameters.len()];
        let of_train = &self.jacobian.of_train;
        for (j, square) in of_train.squares().iter().enumerate() {
            let slope = (square / of_train.nrows().max(1) as f64).sqrt() * z[j].abs().max(1.0);
            let step = &mut steps[study.theta[j].parameter];
            *step = step.min((CHANGE / slope.max(CHANGE)).max(SHORTEST * STEP));
        }
        for (j, apart) in self.variant.instants() {
            let entry = &study.theta[j];
            let slope = entry.transform.derivative(self.variant.theta(z)[j]) * self.variant.unit()[j];
            let step = &mut steps[entry.parameter];
            *step = step.max((apart / slope).min(FARTHEST) / z[j].abs().max(1.0));
        }
        steps
    }

    /// One point per parameter of the study, all of its entries moved by its step.
    pub(crate) fn moved(&self, z: &DVector<f64>, steps: &[f64]) -> Vec<DVector<f64>> {
        let study = &self.variant.study;
        let point = |parameter: usize| {
            let mut moved = z.clone();
            for j in (0..study.theta.len()).filter(|j| study.theta[*j].parameter == parameter) {
                moved[j] += steps[parameter] * moved[j].abs().max(1.0);
            }
            moved
        };
        (0..study.parameters.len()).map(point).collect()
    }

    /// The whitened Jacobian of all rows from forward differences; backward where the model fails on the forward side, nothing
    /// where it fails on both.
    pub(crate) fn differences(
        &self,
        cache: &mut RunCache<'_>,
        z: &DVector<f64>,
        answers: Vec<RowPredictions>,
    ) -> Result<Option<BlockAngular>, ExplainError> {
        let mut steps = self.steps(z);
        let mut found: Vec<Option<Arc<Vec<f64>>>> = answers.into_iter().map(Result::ok).collect();
        let failed: Vec<usize> = (0..found.len()).filter(|k| found[*k].is_none()).collect();
        if !failed.is_empty() {
            let back = self.moved(z, &steps.iter().map(|step| -step).collect::<Vec<_>>());
            let points: Vec<Point<'_>> = failed.iter().map(|k| point(self, &back[*k])).collect();
            for (k, answer) in failed.iter().zip(cache.run(&points)?) {
                found[*k] = answer.ok();
                steps[*k] *= -1.0;
            }
        }
        let Some(found) = found.into_iter().collect::<Option<Vec<_>>>() else { return Ok(None) };
        let rows = &cache.rows;
        let study = &self.variant.study;
        let distance = |j: usize| steps[study.theta[j].parameter] * z[j].abs().max(1.0);
        // A held-out record is run with the mean of the entries, which moves by the mean of their steps. The derivative by one
        // entry is that by the mean over the number of entries, hence the sum of the steps in the denominator.
        let mut together = vec![0.0; study.parameters.len()];
        for (j, entry) in study.theta.iter().enumerate() {
            together[entry.parameter] += distance(j);
        }
        let influence = |i: usize, j: usize| {
            let (row, entry) = (&rows.rows[i], &study.theta[j]);
            let h = match entry.record {
                Some(r) if r != row.record => together[entry.parameter],
                _ => distance(j),
            };
            (found[entry.parameter][i] - self.predicted[i]) / (h * row.noise)
        };
        let blocks = record_blocks(study, rows);
        let mut whole = BlockAngular::from_fn(rows.rows.len(), self.variant.n_param(), blocks, influence);
        if !rows.is_white() {
            whole.for_each_column(|first, values| rows.whiten(first, values));
        }
        Ok(Some(whole))
    }
}
