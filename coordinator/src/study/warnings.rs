//! What a reader must know before using the numbers; every rule is one function over the finished fit.
//!
//! Warnings travel with the result into the summary, the report and the terminal. They never change a number.

use starlings_estimators::{Drift, Transform, autocorrelation, nis_band, weak_directions};

use super::field::field_of;
use super::identify::words::{combination, members};
use super::posterior::{prior, standard_deviations};
use super::store::PredictionRow;
use super::summary::Summary;
use super::{EstimatorKind, Fit, Study};

/// Correlation above which two parameters are reported as one combination.
pub(super) const CORRELATED: f64 = 0.95;
/// Share of the prior sd above which the data are said not to inform a parameter, or a combination of parameters.
pub(super) const UNINFORMED: f64 = 0.9;
/// Share of the spread that resampling may leave out in silence.
const DROPPED: f64 = 0.05;
/// Prior standard deviations beyond which an estimate contradicts its prior.
const FAR_FROM_PRIOR: f64 = 4.0;
/// Posterior standard deviations that a last pass may move the estimate: its linearisation error is of second order in
/// them.
const LAST_MOVE: f64 = 15.0;
/// Ratio of free-run to innovation misfit beyond which the filter's states are no trajectory of its estimate.
const FREE_RUN_RATIO: f64 = 1.15;

/// All warnings of a finished fit, the study's own first.
pub fn collect(study: &Study, fit: &Fit, summary: &Summary, predictions: &[PredictionRow]) -> Vec<String> {
    let mut warnings = study.warnings.clone();
    warnings.extend(nis(fit));
    warnings.extend(not_converged(fit));
    warnings.extend(drift_ignored(study));
    warnings.extend(still_moving(fit));
    warnings.extend(free_run(fit, study, predictions));
    warnings.extend(autocorrelated(study, predictions));
    warnings.extend(correlated_pairs(summary));
    warnings.extend(uninformed(study, fit));
    warnings.extend(uninformed_directions(study, fit));
    warnings.extend(far_from_prior(study, fit));
    warnings.extend(lost(fit));
    warnings.extend(dropped(fit));
    warnings
}

fn nis(fit: &Fit) -> Option<String> {
    let ratio = fit.nis_per_observation();
    let (lo, hi) = nis_band(fit.n_used, 0.999);
    if ratio > hi.max(1.5) {
        Some(format!(
            "NIS is {ratio:.2} per observation, far above 1: the model does not explain the data at the stated noise; \
             residuals are about {:.1} times the noise and the intervals too narrow. Look for a missing effect, or state \
             a larger noise.",
            ratio.sqrt()
        ))
    } else if ratio < lo.min(0.6) {
        Some(format!(
            "NIS is {ratio:.2} per observation, far below 1: the stated noise is too large for these data and the \
             intervals are too wide."
        ))
    } else {
        None
    }
}

fn not_converged(fit: &Fit) -> Option<String> {
    (!fit.converged).then(|| {
        "the batch fit stopped at its iteration limit before it converged: raise [estimator] max_iterations".to_owned()
    })
}

fn still_moving(fit: &Fit) -> Option<String> {
    (fit.last_move > LAST_MOVE).then(|| {
        format!(
            "the last pass still moved an estimate by {:.0} posterior standard deviations: raise [estimator] passes to {} \
             and see whether it has settled.",
            fit.last_move,
            fit.passes + 1
        )
    })
}

/// A whole-record run has one value of each parameter, however much it may drift.
fn drift_ignored(study: &Study) -> Vec<String> {
    let batch = study.estimator.kind == EstimatorKind::Batch;
    let drifting = study.theta.iter().filter(|t| batch && !matches!(t.drift, Drift::None));
    drifting
        .map(|t| {
            format!(
                "the batch fit holds {} at one value for all times although the study lets it drift: use kind = \"roukf\".",
                t.name
            )
        })
        .collect()
}

/// Particles are linear mixtures of states after an analysis; a free run with the estimate shows what that cost.
fn free_run(fit: &Fit, study: &Study, predictions: &[PredictionRow]) -> Option<String> {
    let train: Vec<&PredictionRow> = predictions.iter().filter(|p| p.usage == "train").collect();
    let whitened = train.iter().filter_map(|p| Some((p.observed? - p.predicted) / p.noise));
    let (sum, n) = whitened.fold((0.0, 0_u32), |(sum, n), w| (sum + w * w, n + 1));
    let free = sum / f64::from(n.max(1));
    let filtered = fit.nis_per_observation();
    let drifting = study.theta.iter().any(|t| !matches!(t.drift, Drift::None));
    (!drifting && study.observer_is_off() && free > (FREE_RUN_RATIO * FREE_RUN_RATIO * filtered).max(1.5)).then(|| {
        format!(
            "a free run with the estimate misses the training data by {:.1} times the noise, the filter by {:.1}: its \
             states are no trajectory of the estimate. Use more passes, or kind = \"batch\".",
            free.sqrt(),
            filtered.sqrt()
        )
    })
}

/// Autocorrelation of the residuals, a field's components together.
fn autocorrelated(study: &Study, predictions: &[PredictionRow]) -> Vec<String> {
    let mut series: Vec<Residuals<'_>> = Vec::new();
    for rows in predictions.chunk_by(|a, b| a.record == b.record && a.output == b.output) {
        let trained = rows.iter().filter(|p| p.usage == "train");
        let residuals: Vec<f64> = trained.filter_map(|p| Some(p.observed? - p.predicted)).collect();
        let Some(row) = rows.first().filter(|_| residuals.len() >= 20) else { continue };
        let lag1 = autocorrelation(&residuals, 1).get(1).copied().unwrap_or(0.0);
        let (record, output) = (row.record.as_str(), field_of(&row.output));
        let known = series.iter().position(|s| s.record == record && s.output == output);
        let at = known.unwrap_or_else(|| {
            series.push(Residuals { record, output, lag1: 0.0, n: 0, n_component: 0 });
            series.len() - 1
        });
        series[at].lag1 += lag1;
        series[at].n += residuals.len();
        series[at].n_component += 1;
    }
    // In the order of the outputs, then of the records.
    let place = |s: &Residuals<'_>| {
        let output = study.setup.outputs.iter().position(|o| field_of(o) == s.output);
        (output, study.records.iter().position(|r| r.name == s.record))
    };
    series.sort_by_key(place);
    series.iter().filter_map(Residuals::warning).collect()
}

/// The residuals of one output in one record.
struct Residuals<'a> {
    record: &'a str,
    output: &'a str,
    /// Sum over the components of the autocorrelation at one sample.
    lag1: f64,
    n: usize,
    n_component: usize,
}

impl Residuals<'_> {
    fn warning(&self) -> Option<String> {
        let lag1 = self.lag1 / self.n_component as f64;
        let effective = self.n as f64 * (1.0 - lag1) / (1.0 + lag1);
        (lag1 > 0.5).then(|| {
            format!(
                "residuals of {} in {} are autocorrelated ({lag1:.2} at one sample): {} samples carry the information \
                 of about {effective:.0}, and the intervals are too narrow.",
                self.output, self.record, self.n
            )
        })
    }
}

fn correlated_pairs(summary: &Summary) -> Vec<String> {
    let mut found = Vec::new();
    for (i, row) in summary.correlation.iter().enumerate() {
        for (j, value) in row.iter().enumerate().skip(i + 1) {
            if value.abs() > CORRELATED {
                found.push(correlated(&summary.parameters[i].name, &summary.parameters[j].name, *value));
            }
        }
    }
    found
}

/// Two parameters that are known as one.
pub(super) fn correlated(first: &str, second: &str, value: f64) -> String {
    format!(
        "{first} and {second} are correlated ({value:.3}): the data determine their combination, not each of them."
    )
}

fn uninformed(study: &Study, fit: &Fit) -> Vec<String> {
    let sd = standard_deviations(&fit.posterior);
    study
        .theta
        .iter()
        .zip(&sd)
        .filter(|(entry, sd)| **sd > UNINFORMED * entry.prior_sd)
        .map(|(entry, sd)| {
            format!(
                "the data say almost nothing about {}: its uncertainty is still {:.0} % of the prior's.",
                entry.name,
                100.0 * sd / entry.prior_sd
            )
        })
        .collect()
}

/// Combinations that keep their prior although not each of their parameters does.
fn uninformed_directions(study: &Study, fit: &Fit) -> Vec<String> {
    let names: Vec<&str> = study.theta.iter().map(|t| t.name.as_str()).collect();
    let prior_sd: Vec<f64> = study.theta.iter().map(|t| t.prior_sd).collect();
    let sd = standard_deviations(&fit.posterior);
    let keeps = |j: &usize| sd[*j] > UNINFORMED * prior_sd[*j];
    weak_directions(&fit.posterior.covariance, &prior_sd, UNINFORMED)
        .iter()
        .filter(|direction| !members(direction).iter().all(keeps))
        .map(|direction| uninformed_combination(&combination(&names, direction), direction.share))
        .collect()
}

/// A combination about which the data say almost nothing.
pub(super) fn uninformed_combination(combination: &str, share: f64) -> String {
    format!(
        "the data say almost nothing about the combination {combination} (each in units of its prior sd): its uncertainty \
         is still {:.0} % of the prior's.",
        100.0 * share
    )
}

fn far_from_prior(study: &Study, fit: &Fit) -> Vec<String> {
    let prior = prior(study);
    study
        .theta
        .iter()
        .enumerate()
        .filter_map(|(j, entry)| {
            let distance = (fit.posterior.mean[j] - prior.mean[j]).abs() / entry.prior_sd;
            let bounded = matches!(entry.transform, Transform::Logit { .. });
            (distance > FAR_FROM_PRIOR).then(|| {
                let remedy =
                    if bounded { "it sits at a bound" } else { "widen the prior, or bound it with logit" };
                format!(
                    "{} is {distance:.1} prior standard deviations from its prior median: {remedy}.",
                    entry.name
                )
            })
        })
        .collect()
}

fn dropped(fit: &Fit) -> Option<String> {
    (fit.dropped > DROPPED).then(|| {
        format!(
            "resampling left out up to {:.0} % of the ensemble's spread: the model bends within it. Use tighter priors, or \
             more passes.",
            100.0 * fit.dropped
        )
    })
}

fn lost(fit: &Fit) -> Option<String> {
    (fit.counts.rescued > 0).then(|| {
        format!(
            "{} sigma points failed and were pulled towards the mean or dropped; at the worst analysis {:.0} % of the \
             ensemble's spread was lost.",
            fit.counts.rescued,
            100.0 * fit.information_lost
        )
    })
}
