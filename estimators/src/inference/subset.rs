//! A fit of some of a structure's coefficients, the others absent, told with the indices of the whole structure.
//!
//! Read next: `missing.rs`, which asks for many of them.

use nalgebra::{DMatrix, DVector};

use super::missing::Score;
use super::{Fit, InferenceError, Posterior, Structure, Sums};
use crate::quantiles::fisher_tail;

/// What fits of parts of a structure have in common.
pub(crate) struct Subset<'a> {
    pub(crate) fit: &'a Fit,
    pub(crate) sums: &'a Sums,
    pub(crate) structure: &'a Structure,
}

impl Subset<'_> {
    /// The posterior of the coefficients at these indices, in rising order.
    pub(crate) fn posterior(&self, coefficients: &[usize]) -> Result<Posterior, InferenceError> {
        let structure = self.structure.only(coefficients);
        let fit = Fit { prior: self.fit.prior.only(coefficients), ..self.fit.clone() };
        let part = fit.posterior(self.sums, &structure)?;
        let whole = |indices: &[usize]| indices.iter().map(|i| coefficients[*i]).collect::<Vec<_>>();
        let active = whole(part.active());
        let observed: Vec<usize> = (0..coefficients.len()).filter(|i| part.estimates[*i].observed).collect();
        let observed = whole(&observed);
        let estimates =
            Posterior::estimates(self.structure, &active, &observed, &part.mean, &part.covariance);
        Ok(Posterior { estimates, active, ..part })
    }

    /// ln of the likelihood at the posterior mean, at a given noise.
    pub(crate) fn log_likelihood(&self, posterior: &Posterior, noise: &DMatrix<f64>) -> Option<f64> {
        self.fit.action(self.sums, posterior, noise).map(|action| -action)
    }
}

/// The F test of coefficients against zero. `None` where one of them has no value.
pub(crate) fn score(
    posterior: &Posterior,
    coefficients: &[usize],
    allowed: impl Fn(usize) -> bool,
) -> Option<Score> {
    let at = |c: &usize| posterior.active.iter().position(|a| a == c);
    let rows: Vec<usize> = coefficients.iter().map(at).collect::<Option<_>>()?;
    let mean: DVector<f64> = posterior.mean.select_rows(&rows);
    let covariance = posterior.covariance.select_rows(&rows).select_columns(&rows);
    let chi_squared = mean.dot(&covariance.cholesky()?.solve(&mean));
    let n = rows.len() as f64;
    let left = posterior.least_degrees().unwrap_or(f64::INFINITY);
    let by_chance = fisher_tail(chi_squared / n, n, left);
    let allowed = coefficients.iter().all(|c| allowed(*c));
    Some(Score { coefficients: coefficients.to_vec(), chi_squared, by_chance, allowed })
}
