//! By how much a value that would be measured differs from the prediction: the noise, or more where the fit left more.
//!
//! The residuals of the free run with the estimate hold the noise and what the model lacks. Where they exceed the stated noise, the
//! errors of measured values are taken as large as they are. An output that was never fitted has no residuals of its own: the noise
//! stated for it counts as wrong by the same factor as that of the fitted outputs (Birge, *Phys. Rev.* 1932), unless its own
//! measured values say more (`own_errors.rs`). Held-out values of fitted outputs do not enter. A band holds at each time by itself, for which the correlation of the errors does not count.

use serde::Serialize;
use starlings_models::BuildSetup;

use crate::store::StoreError;
use crate::{RunFolder, Study};

/// Where the size of the errors of measured values comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum From {
    /// The stated noise, which the residuals do not exceed, or whose place they cannot take.
    Noise,
    /// The residuals of the output, which exceed its noise.
    Residuals,
    /// The residuals of the outputs that were fitted, which exceed their noise; this one was not fitted.
    OtherResiduals,
    /// Its own measured values, which differ by more; it was not fitted.
    OwnValues,
    /// The errors of the measurement that an inference was given, or that residuals of neighbouring steps share.
    Inferred,
}

/// The errors of measured values of one output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Standard deviation that was stated.
    pub noise: f64,
    /// Standard deviation that is used.
    pub sd: f64,
    /// Where it comes from.
    pub from: From,
}

/// Squared training residuals in units of their noise, summed by output.
pub(super) struct TrainingResiduals {
    outputs: Vec<(String, f64, f64)>,
    /// Share of the residuals that the parameters leave free.
    free: f64,
    is_noisy: bool,
}

impl TrainingResiduals {
    /// Of the free run that a finished run left in its store.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub(super) fn read(study: &Study, folder: &RunFolder) -> Result<Self, StoreError> {
        let sql = "SELECT output, observed, predicted, noise FROM predictions \
            WHERE use = 'train' AND observed IS NOT NULL ORDER BY output, record, time";
        let rows = folder.store.rows(sql, |row| {
            let number = |at: usize| row.get::<_, f64>(at);
            Ok((row.get::<_, String>(0)?, (number(1)? - number(2)?) / number(3)?))
        })?;
        let mut outputs: Vec<(String, f64, f64)> = Vec::new();
        for (name, residual) in rows.iter().filter(|(_, residual)| residual.is_finite()) {
            match outputs.last_mut().filter(|last| last.0 == *name) {
                Some((_, sum, n)) => (*sum, *n) = (residual.mul_add(*residual, *sum), *n + 1.0),
                None => outputs.push((name.clone(), residual * residual, 1.0)),
            }
        }
        let n: f64 = outputs.iter().map(|(_, _, n)| n).sum();
        let parameters = study.theta.len() as f64;
        // With fewer than two residuals per parameter most of what the parameters are comes from the prior.
        let free = if n < 2.0 * parameters { 1.0 } else { 1.0 - parameters / n };
        Ok(Self { outputs, free, is_noisy: study.setup.is_noisy() })
    }

    /// Whether the errors of an output can be told by its own measured values: it was never fitted, and nothing but the parameters
    /// moves the members.
    pub(super) fn are_none_of(&self, output: &str) -> bool {
        !self.is_noisy && !self.outputs.iter().any(|(name, _, _)| name == output)
    }

    /// The errors of an output with this stated noise. Where the states have noise the residuals of a free run hold that too, and
    /// so do the members: then the stated noise is used.
    pub(super) fn errors(&self, output: &str, noise: f64) -> Errors {
        let ratio = |sum: f64, n: f64| (sum / (n * self.free)).sqrt();
        let own = self.outputs.iter().find(|(name, _, _)| name == output);
        let (ratio, from) = match own {
            _ if self.is_noisy || self.outputs.is_empty() => (1.0, From::Noise),
            Some((_, sum, n)) => (ratio(*sum, *n), From::Residuals),
            None => {
                let all = self.outputs.iter().fold((0.0, 0.0), |all, (_, sum, n)| (all.0 + sum, all.1 + n));
                (ratio(all.0, all.1), From::OtherResiduals)
            }
        };
        if ratio > 1.0 {
            Errors { noise, sd: noise * ratio, from }
        } else {
            Errors { noise, sd: noise, from: From::Noise }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(outputs: &[(&str, f64, f64)], is_noisy: bool) -> TrainingResiduals {
        let outputs = outputs.iter().map(|(name, sum, n)| ((*name).to_owned(), *sum, *n)).collect();
        TrainingResiduals { outputs, free: 0.5, is_noisy }
    }

    #[test]
    fn errors_are_as_large_as_the_residuals_and_never_smaller_than_the_noise() {
        // 50 residuals with a sum of squares of 225 noise variances, half of which the parameters leave free: 3 noise sd.
        let residuals = of(&[("p", 225.0, 50.0), ("q", 1.0, 50.0)], false);
        assert!(residuals.are_none_of("r") && !residuals.are_none_of("p"));
        assert_eq!(residuals.errors("p", 0.5), Errors { noise: 0.5, sd: 1.5, from: From::Residuals });
        assert_eq!(residuals.errors("q", 2.0), Errors { noise: 2.0, sd: 2.0, from: From::Noise });
        // Of both together: 226 over 50.
        let other = residuals.errors("r", 1.0);
        assert!((other.sd - 4.52_f64.sqrt()).abs() < 1e-12 && other.from == From::OtherResiduals);
        let noisy = of(&[("p", 225.0, 50.0)], true).errors("p", 0.5);
        assert_eq!(noisy, Errors { noise: 0.5, sd: 0.5, from: From::Noise });
    }
}
