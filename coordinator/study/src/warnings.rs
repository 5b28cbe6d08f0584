//! What a reader must know before using the numbers; every rule is one function over the finished fit.
//!
//! Warnings travel with the result into the summary, the report and the terminal. They never change a number. Next file to
//! read: [`consistency`].

mod alike;
mod consistency;
pub(crate) mod residuals;

use starlings_estimators::{Drift, Transform, weak_directions};

use self::residuals::Residuals;
use super::identify::words::{combination, listed, members};
use super::posterior::{prior, standard_deviations};
use super::store::PredictionRow;
use super::summary::Summary;
use super::{Fit, Study};

/// Correlation above which two parameters are reported as one combination.
pub const CORRELATED: f64 = 0.95;
/// Share of the prior sd above which the data are said not to inform a parameter, or a combination of parameters.
pub(super) const UNINFORMED: f64 = 0.9;
/// Share of the spread that resampling may leave out without a warning.
const DROPPED: f64 = 0.05;
/// Prior standard deviations beyond which an estimate contradicts its prior.
pub const FAR_FROM_PRIOR: f64 = 4.0;
/// Share of the distance between two bounds within which an estimate sits at one of them.
const AT_BOUND: f64 = 0.01;

/// All warnings of a finished fit, the study's own first.
pub(crate) fn collect(
    study: &Study,
    fit: &Fit,
    summary: &Summary,
    predictions: &[PredictionRow],
    residuals: &[Residuals],
) -> Vec<String> {
    let mut warnings = study.warnings.clone();
    warnings.extend(consistency::nis(fit, residuals));
    warnings.extend(not_converged(study, fit));
    warnings.extend(drift_ignored(study));
    warnings.extend(consistency::still_moving(study, fit));
    warnings.extend(consistency::free_run(fit, study, predictions));
    warnings.extend(consistency::autocorrelated(residuals));
    warnings.extend(alike::correlated_sets(summary));
    warnings.extend(uninformed(study, fit));
    warnings.extend(uninformed_directions(study, fit));
    warnings.extend(far_from_prior(study, fit));
    warnings.extend(lost(fit));
    warnings.extend(dropped(fit));
    warnings
}

fn not_converged(study: &Study, fit: &Fit) -> Option<String> {
    let kind = study.estimator.kind.name;
    if fit.converged {
        return None;
    }
    if fit.posterior.mean == prior(study).mean {
        return Some(format!(
            "the {kind} fit took no step before its iteration limit: the estimates are the prior medians, and the intervals are those around \
             them. Raise [estimator] max_iterations."
        ));
    }
    Some(format!(
        "the {kind} fit stopped at its iteration limit before it converged: raise [estimator] max_iterations"
    ))
}

/// A whole-record run has one value of each parameter, however much it may drift.
fn drift_ignored(study: &Study) -> Vec<String> {
    let batch = !study.estimator.kind.is_filter();
    let drifting = study.theta.iter().filter(|t| batch && !matches!(t.drift, Drift::None));
    drifting
        .map(|t| {
            format!(
                "the {} fit holds {} at one value for all times although the study lets it drift: use kind = \"roukf\".",
                study.estimator.kind.name, t.name
            )
        })
        .collect()
}

/// The warning that two parameters are known only in combination.
pub(super) fn correlated(first: &str, second: &str, value: f64) -> String {
    format!(
        "{first} and {second} are correlated ({value:.3}): the data determine their combination, not each of them."
    )
}

fn uninformed(study: &Study, fit: &Fit) -> Option<String> {
    let sd = standard_deviations(&fit.posterior);
    let entries = study.theta.iter().zip(&sd).enumerate().filter(|(j, _)| !is_at_the_end(fit, *j));
    let shares = entries.map(|(_, (entry, sd))| (entry.name.as_str(), sd / entry.prior_sd));
    let (names, shares): (Vec<&str>, Vec<f64>) = shares.filter(|(_, share)| *share > UNINFORMED).unzip();
    let ends = (shares.iter().copied().reduce(f64::min)?, shares.iter().copied().reduce(f64::max)?);
    let (lo, hi) = (100.0 * ends.0, 100.0 * ends.1);
    let whose = if names.len() == 1 { "its" } else { "their" };
    let share = if hi - lo < 0.5 { format!("{hi:.0}") } else { format!("{lo:.0} to {hi:.0}") };
    let names = listed(&names);
    Some(format!(
        "the data say almost nothing about {names}: {whose} uncertainty is still {share} % of the prior's."
    ))
}

/// Combinations about which the data say almost nothing although they inform some of their parameters.
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

/// The warning about such a combination.
pub(super) fn uninformed_combination(combination: &str, share: f64) -> String {
    format!(
        "the data say almost nothing about the combination {combination} (each in units of its prior sd): its uncertainty \
         is still {:.0} % of the prior's.",
        100.0 * share
    )
}

/// Whether an entry ends as the state of a record at its last analysis.
fn is_at_the_end(fit: &Fit, entry: usize) -> bool {
    fit.starts.iter().any(|(of, _)| *of == entry)
}

fn far_from_prior(study: &Study, fit: &Fit) -> Vec<String> {
    let prior = prior(study);
    study
        .theta
        .iter()
        .enumerate()
        // The state at the end of a record is not what its prior spoke of.
        .filter(|(j, _)| !is_at_the_end(fit, *j))
        .filter_map(|(j, entry)| {
            let distance = (fit.posterior.mean[j] - prior.mean[j]).abs() / entry.prior_sd;
            let estimate = entry.transform.to_physical(fit.posterior.mean[j]);
            (distance > FAR_FROM_PRIOR).then(|| {
                // What a model lacks is made up for by whatever can.
                let is_unexplained = fit.nis_per_observation() > consistency::FAR_ABOVE;
                let lacks = if is_unexplained {
                    "; or the model lacks what it makes up for: see `starlings explain`"
                } else {
                    ""
                };
                format!(
                    "{} is {distance:.1} prior standard deviations from its prior median: {}{lacks}.",
                    entry.name,
                    far_remedy(entry.transform, estimate)
                )
            })
        })
        .collect()
}

/// What to do about an estimate far from its prior: one with two bounds may lie at one of them, or just far from the median.
fn far_remedy(transform: Transform, estimate: f64) -> String {
    match transform {
        Transform::Logit { lo, hi } if estimate - lo < AT_BOUND * (hi - lo) => {
            format!("it sits at its lower bound, {lo}")
        }
        Transform::Logit { lo, hi } if hi - estimate < AT_BOUND * (hi - lo) => {
            format!("it sits at its upper bound, {hi}")
        }
        Transform::Logit { .. } => "widen the prior".to_owned(),
        _ => "widen the prior, or bound it with logit".to_owned(),
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_an_estimate_at_a_bound_is_said_to_sit_there() {
        let bounded = Transform::Logit { lo: 0.0, hi: 10.0 };
        assert_eq!(far_remedy(bounded, 0.05), "it sits at its lower bound, 0");
        assert_eq!(far_remedy(bounded, 9.95), "it sits at its upper bound, 10");
        assert_eq!(far_remedy(bounded, 6.0), "widen the prior");
        assert_eq!(far_remedy(Transform::Log, 6.0), "widen the prior, or bound it with logit");
    }
}
