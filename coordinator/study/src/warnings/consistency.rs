//! Whether model, noise and residuals fit together: NIS, correlation in time, and whether the estimate is where it should be.
//!
//! Every rule is a test with a stated probability of a false alarm, not a fixed limit: what a right model with white noise of
//! the stated sd would show by chance is no warning. Next file to read: [`super::residuals`].

use starlings_estimators::{Drift, autocorrelation, effective_nis_band};

use super::residuals::Residuals;
use crate::constants::in_sds;
use crate::store::PredictionRow;
use crate::{Fit, Study, fit::settle, posterior};

/// Probability with which NIS of a right model stays within its band.
const LEVEL: f64 = 0.998;
/// NIS per observation that is far above one.
pub(super) const FAR_ABOVE: f64 = 1.5;
/// Probability of a false alarm about correlated residuals, over all series of a study.
const CORRELATED_BY_CHANCE: f64 = 1e-3;
/// Factor by which correlation must raise the variance of a mean to be reported, where it is certain but not strong.
const LEAST_INFLATION: f64 = 1.5;
/// Autocorrelation at one sample above which it is always reported.
const STRONG: f64 = 0.5;
/// Lags of the test for white residuals; a fifth of the series where that is less (Hyndman & Athanasopoulos 2021, section 5.4).
const LAGS: usize = 10;
/// Values below which a series is not tested for correlation.
const FEWEST: usize = 20;
/// Squared distance, in posterior sd, of an estimate from the best up to which a free run gives no warning.
const OFF: f64 = 1.0;
/// Share of the misfit that passes for rounding.
const ROUNDING: f64 = 1e-6;

/// NIS outside the band that a right model keeps to, given how many of the residuals are independent.
///
/// The mean of n correlated squares varies as that of n/τ independent ones, τ their integrated autocorrelation time (Sokal
/// 1997, section 3), and n/τ independent ones are χ² distributed (Bar-Shalom, Li & Kirubarajan 2001, section 5.4).
pub(super) fn nis(fit: &Fit, residuals: &[Residuals]) -> Option<String> {
    let ratio = fit.nis_per_observation();
    let n: f64 = residuals.iter().map(Residuals::independent_squares).sum();
    let n = if n > 0.0 { n.min(fit.n_used as f64) } else { fit.n_used as f64 };
    let (lo, hi) = effective_nis_band(n, LEVEL);
    let band = format!("by chance {lo:.2} to {hi:.2}, with {n:.0} independent residuals");
    if ratio > hi {
        let far = if ratio > FAR_ABOVE { "far above" } else { "above" };
        Some(format!(
            "NIS is {ratio:.2} per observation, {far} 1 ({band}): the model does not explain the data at the stated noise; \
             residuals are about {:.1} times the noise and the intervals at the stated noise too narrow. Look for a missing effect by `starlings explain`, or state \
             a larger noise.",
            ratio.sqrt()
        ))
    } else if ratio < lo {
        let far = if ratio < 0.6 { "far below" } else { "below" };
        Some(format!(
            "NIS is {ratio:.2} per observation, {far} 1 ({band}): the stated noise is too large for these data and the \
             intervals are too wide."
        ))
    } else {
        None
    }
}

/// Residuals that are correlated in time, record by record.
pub(super) fn autocorrelated(residuals: &[Residuals]) -> Vec<String> {
    let tested = residuals.iter().filter(|r| r.components.iter().any(|c| c.len() >= FEWEST));
    tested.filter_map(|r| correlated_in_time(r, residuals.len())).collect()
}

fn correlated_in_time(residuals: &Residuals, n_series: usize) -> Option<String> {
    let long = residuals.components.iter().filter(|c| c.len() >= FEWEST);
    let lags: Vec<f64> = long.map(|c| autocorrelation(c, 1).get(1).copied().unwrap_or(0.0)).collect();
    let lag1 = lags.iter().sum::<f64>() / lags.len() as f64;
    let pooled = residuals.pooled();
    let chance = pooled.ljung_box(LAGS.min(pooled.length() / 5));
    let certain = chance < CORRELATED_BY_CHANCE / n_series as f64;
    let n: usize = residuals.n();
    let effective = if lag1 > STRONG {
        n as f64 * (1.0 - lag1) / (1.0 + lag1)
    } else if certain && pooled.inflation() > LEAST_INFLATION {
        n as f64 / pooled.inflation()
    } else {
        return None;
    };
    Some(format!(
        "residuals of {} in {} are autocorrelated ({lag1:.2} at one sample): {n} samples carry the information of about \
         {effective:.0}, and the intervals at the stated noise are too narrow.",
        residuals.output, residuals.record
    ))
}

/// The last pass moved the estimate further than an estimate that has settled is moved.
pub(super) fn still_moving(study: &Study, fit: &Fit) -> Option<String> {
    let moved = fit.last_move.filter(|m| !m.is_settled())?;
    Some(moving(&study.theta[moved.entry].name, &in_sds(moved.size), fit.passes, study.passes().is_some()))
}

/// That the last of so many passes, fixed in the study or not, moved an estimate so far.
fn moving(name: &str, size: &str, passes: usize, are_fixed: bool) -> String {
    if are_fixed {
        format!(
            "the last pass, number {passes}, still moved {name} by {size} posterior standard deviations: whether the estimate \
             has settled is not known. Leave out [estimator] passes, and there are as many as it takes."
        )
    } else if passes == settle::LIMIT {
        format!(
            "after {passes} passes, the limit, the last pass still moved {name} by {size} posterior standard deviations: the \
             estimate has not settled. Start from priors nearer to it, or use kind = \"batch\"."
        )
    } else {
        format!(
            "after {passes} passes the last pass still moved {name} by {size} posterior standard deviations, and no part of \
             that step lowers the misfit: the estimate has not settled. Use kind = \"batch\"."
        )
    }
}

/// Particles are linear mixtures of states after an analysis; a free run with the estimate shows what that cost.
///
/// The filter's NIS is the least value that squared misfit and squared distance from the prior can take together; what a run
/// with the estimate has more than that is the square of its distance from the best, in posterior standard deviations.
pub(super) fn free_run(fit: &Fit, study: &Study, predictions: &[PredictionRow]) -> Option<String> {
    let drifting = study.theta.iter().any(|t| !matches!(t.drift, Drift::None));
    if !study.estimator.kind.is_filter() || drifting || !study.observer_is_off() {
        return None;
    }
    let train = predictions.iter().filter(|p| p.usage == "train");
    let whitened = train.filter_map(|p| Some((p.observed? - p.predicted) / p.noise));
    let (misfit, n) = whitened.fold((0.0, 0_u32), |(sum, n), w| (sum + w * w, n + 1));
    let prior = posterior::prior(study);
    let far = (&fit.posterior.mean - &prior.mean)
        .component_div(&prior.covariance.diagonal().map(f64::sqrt))
        .norm_squared();
    let excess = misfit + far - fit.nis;
    let rms = |sum: f64| (sum.max(0.0) / f64::from(n.max(1))).sqrt();
    let cure = if study.passes().is_some() { "Leave out [estimator] passes, or use" } else { "Use" };
    (excess > OFF.max(ROUNDING * misfit)).then(|| {
        format!(
            "a free run with the estimate misses the training data by {:.2} times the noise, the filter by {:.2}, which puts \
             the estimate about {:.0} posterior standard deviations from the best one: the filter's states are no trajectory of \
             its estimate. {cure} kind = \"batch\".",
            rms(misfit),
            rms(misfit - excess),
            excess.sqrt()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_that_moves_still_is_told_with_what_to_do_about_it() {
        let told = moving("R", "2.4", settle::LIMIT, false);
        assert_eq!(
            told,
            "after 12 passes, the limit, the last pass still moved R by 2.4 posterior standard deviations: the estimate has not \
             settled. Start from priors nearer to it, or use kind = \"batch\"."
        );
        let stuck = moving("R", "2.4", 5, false);
        assert!(
            stuck.contains("and no part of that step lowers the misfit") && stuck.contains("batch"),
            "{stuck}"
        );
        assert!(
            moving("R", "2.4", 12, true)
                .ends_with("Leave out [estimator] passes, and there are as many as it takes.")
        );
    }
}
