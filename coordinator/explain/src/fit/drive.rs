//! Drives the fits of several variants at a time: in every round the runs that all of them need next go to the fleet in one
//! batch.
//!
//! A Jacobian takes one run per parameter of the study: a parameter with one value per record is moved in all records at
//! once, and each record answers to its own. Next files to read: [`super::fitted_variant`] for one of them, then
//! [`super::differences`].

use nalgebra::DVector;
use starlings_estimators::Need;

use super::fitted_variant::{FittedVariant, point};
use super::jacobian::SplitJacobian;
use crate::error::ExplainError;
use crate::run_cache::{Point, RowPredictions, RunCache};

/// Drives fits until none needs a run. Returns whether the budget sufficed; a fit that it cut off keeps its best point.
///
/// # Errors
/// When the fleet or the store fails.
pub fn drive(cache: &mut RunCache<'_>, fits: &mut [FittedVariant<'_>]) -> Result<bool, ExplainError> {
    drive_rounds(cache, fits, usize::MAX)
}

/// As [`drive`], with at most `rounds` rounds.
///
/// # Errors
/// When the fleet or the store fails.
pub(crate) fn drive_rounds(
    cache: &mut RunCache<'_>,
    fits: &mut [FittedVariant<'_>],
    rounds: usize,
) -> Result<bool, ExplainError> {
    for _ in 0..rounds {
        let asked: Vec<Vec<DVector<f64>>> = fits.iter().map(FittedVariant::points).collect();
        let n: usize = asked.iter().map(Vec::len).sum();
        if n == 0 {
            return Ok(true);
        }
        if !cache.affords(n) {
            return Ok(false);
        }
        let points: Vec<Point<'_>> =
            fits.iter().zip(&asked).flat_map(|(fit, of_fit)| of_fit.iter().map(|z| point(fit, z))).collect();
        let mut answers = cache.run(&points)?.into_iter();
        let mut afforded = true;
        for (fit, of_fit) in fits.iter_mut().zip(asked) {
            let of_fit: Vec<_> = answers.by_ref().take(of_fit.len()).collect();
            if !of_fit.is_empty() {
                afforded &= fit.take(cache, of_fit)?;
            }
        }
        if !afforded {
            return Ok(false);
        }
    }
    Ok(true)
}

impl FittedVariant<'_> {
    /// The points to run for what the solver needs.
    fn points(&self) -> Vec<DVector<f64>> {
        match self.solver.need() {
            Need::Residual(z) => vec![z.clone()],
            Need::Jacobian(z) => self.moved(z, &self.steps(z)),
            Need::Nothing(_) => Vec::new(),
        }
    }
    /// Hands the predictions to the solver. Returns whether the budget sufficed for the backward differences where a forward one
    /// failed; if not, the fit keeps its best point.
    fn take(&mut self, cache: &mut RunCache<'_>, answers: Vec<RowPredictions>) -> Result<bool, ExplainError> {
        match self.solver.need().clone() {
            Need::Residual(z) => {
                let answer = answers.into_iter().next().and_then(Result::ok);
                let residual = answer.as_ref().map(|y| cache.rows.train_residual(y));
                self.solver.give_residual(residual);
                if let Some(predicted) = answer.filter(|_| *self.solver.best().0 == z) {
                    self.predicted = predicted;
                }
            }
            Need::Jacobian(z) => {
                if !cache.affords(answers.iter().filter(|a| a.is_err()).count()) {
                    return Ok(false);
                }
                let jacobian = self.differences(cache, &z, answers)?;
                let jacobian = jacobian.map(|whole| SplitJacobian::of(&whole, &cache.rows));
                self.solver.give_jacobian(jacobian.as_ref().map(|j| j.of_train.clone()));
                self.jacobian = jacobian.unwrap_or_else(|| std::mem::take(&mut self.jacobian));
            }
            Need::Nothing(_) => {}
        }
        Ok(true)
    }
}
