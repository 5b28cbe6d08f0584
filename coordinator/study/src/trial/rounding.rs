//! A solver that prints its outputs with few digits, and how far apart sigma points must be for their differences not to be rounding.
//!
//! An estimator learns from differences of runs: where the points are so close that these are no larger than the last digit, rounding looks like
//! information, and intervals come out too narrow. Outputs that all end early, at the prior median and beside it, where a model
//! has no reason to give short numbers, were rounded. Next file to read: [`super::dry_run`].

use std::sync::Arc;

use nalgebra::DVector;
use starlings_estimators::SigmaSet;
use starlings_models::units::rounded;
use starlings_models::{SOLVER, Window, quoted_list};

use super::{Runner, run};
use crate::{Study, posterior};

/// Significant digits from which on a number may be all that a 64-bit float holds.
const ALL: i32 = 15;

/// Values without which nothing is said of an output.
const FEWEST: usize = 8;

/// Where the second run is made, in prior sd from the median.
const BESIDE: f64 = 0.0577;

/// How far apart points have to be.
struct Rule {
    /// Share of the information in whose sd the points lie that rounding may seem to bring.
    share: f64,
    /// Sd from each other at most: further off a model bends.
    widest: f64,
}

/// A filter's points lie in prior sd ...
const OF_PRIOR: Rule = Rule { share: 0.25, widest: 0.3 };

/// ... and those of a fit of whole records in posterior sd.
const OF_POSTERIOR: Rule = Rule { share: 0.002, widest: 1.0 };

/// Share of the posterior's information that rounding seems to bring where the points are a posterior sd apart, beyond which no distance helps.
const HOPELESS: f64 = 0.02;

/// What the rounding of one output is worth.
struct Rounded {
    output: String,
    /// The largest step between two values that it may show.
    step: f64,
    /// Sum of the variances of rounding over those of the noise, over the fitted values.
    variances: f64,
}

/// Whether each output of a solver looks rounded in the first run of a trial, which is not made again for that.
pub(super) fn of_outputs(study: &Study, outputs: &[f64]) -> Vec<bool> {
    let n = study.setup.outputs.len();
    let is_solver = study.setup.model.kind == SOLVER;
    let course = |row| outputs.iter().skip(row).step_by(n).copied().collect::<Vec<_>>();
    (0..n).map(|row| is_solver && steps(&course(row)).is_some()).collect()
}

/// Where outputs look rounded at the prior median, finds out whether the solver rounds them. Places the points of the study further apart then, and
/// says so; where the study says how far, it is told if that is too near.
pub(super) fn heed(study: &mut Study, model: &dyn Runner) {
    if study.estimator.kind.has_exact_slopes() {
        return;
    }
    let mean = posterior::prior(study).mean;
    let sd = DVector::from_iterator(mean.len(), study.theta.iter().map(|entry| entry.prior_sd));
    let beside = found(study, model, (mean + BESIDE * sd).as_slice());
    if beside.is_empty() {
        return;
    }
    let variances: f64 = beside.iter().map(|rounded| rounded.variances).sum();
    let Ok(set) = SigmaSet::new(study.estimator.points, study.theta.len()) else { return };
    let per_point = variances / set.n_particle() as f64;
    study.rounding.variances = per_point;
    let is_filter = study.estimator.kind.is_filter();
    // One pass, and a parameter that drifts, have points as far apart as the prior or the posterior.
    if is_filter && (study.estimator.passes == Some(1) || study.drifts()) {
        return;
    }
    let usual = study.estimator.spread;
    let wanted = two_digits_up(apart(per_point, if is_filter { &OF_PRIOR } else { &OF_POSTERIOR }));
    if per_point > HOPELESS {
        study.warnings.push(hopeless(&beside));
    } else if wanted > usual {
        study.warnings.push(told(&beside, [usual, wanted], study.rounding.is_spread_given));
        study.rounding.spread = (!study.rounding.is_spread_given).then_some(wanted);
    }
}

/// The distance of points at which the slopes, which rounding makes uncertain, seem to bring no more than a share of the information: with r points
/// in a distance s a slope has the variance of a value over r s².
fn apart(variances_per_point: f64, rule: &Rule) -> f64 {
    (variances_per_point / rule.share).sqrt().min(rule.widest)
}

/// The same in prior sd, for slopes that no fit is made with; zero where nothing is rounded, or the study says how far.
pub(crate) fn apart_in_prior_sd(study: &Study) -> f64 {
    if study.rounding.is_spread_given { 0.0 } else { apart(study.rounding.variances, &OF_PRIOR) }
}

/// The outputs that are rounded at this point; none where a run fails, of which others tell.
fn found(study: &Study, model: &dyn Runner, transformed: &[f64]) -> Vec<Rounded> {
    let mut all: Vec<Rounded> = Vec::new();
    for index in (0..study.records.len()).filter(|index| study.records[*index].is_trained()) {
        let window = Arc::new(study.whole(index, !study.whole_answers));
        let sent = study.sendable(index, &window);
        let Ok(prediction) = run(model, index, &sent, &study.theta_for(index, transformed), None) else {
            return Vec::new();
        };
        let Some(of_record) = in_record(study, index, &window, &prediction.outputs) else {
            return Vec::new();
        };
        for new in of_record {
            match all.iter_mut().find(|known| known.output == new.output) {
                Some(known) => {
                    known.step = known.step.max(new.step);
                    known.variances += new.variances;
                }
                None => all.push(new),
            }
        }
    }
    all
}

/// The rounded outputs of one record; `None` where a channel is no output as it stands.
fn in_record(study: &Study, index: usize, window: &Window, outputs: &[f64]) -> Option<Vec<Rounded>> {
    let (record, n) = (&study.records[index], study.setup.outputs.len());
    let mut list = Vec::new();
    for channel in record.channels.iter().filter(|channel| !channel.held_out) {
        channel.node.is_none().then_some(())?;
        let values: Vec<f64> = outputs.iter().skip(channel.row).step_by(n).copied().collect();
        let Some(steps) = steps(&values) else { continue };
        let fitted = window.times.iter().zip(&steps).filter(|(time, _)| {
            record.trains_at(**time) && record.observed(channel, **time).is_some_and(f64::is_finite)
        });
        // The error of rounding is uniform over a step.
        let variances = fitted.map(|(_, step)| step * step / 12.0 / (channel.noise * channel.noise)).sum();
        let step = steps.iter().copied().fold(0.0, f64::max);
        list.push(Rounded { output: channel.output.clone(), step, variances });
    }
    Some(list)
}

/// The step between two values that could be shown, for each of these; `None` where they have all digits, or are too few or too much alike to tell.
fn steps(values: &[f64]) -> Option<Vec<f64>> {
    let mut different: Vec<u64> = values.iter().filter(|v| **v != 0.0).map(|v| v.to_bits()).collect();
    different.sort_unstable();
    different.dedup();
    if different.len() < FEWEST || values.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let written: Vec<(i32, i32)> = values.iter().map(|v| digits(*v)).collect();
    let most = written.iter().map(|(digits, _)| *digits).max()?;
    if most >= ALL {
        // What a program holds in 32 bits has as many digits, of which half are none.
        let is_single = values.iter().all(|v| f64::from(*v as f32).to_bits() == v.to_bits());
        return is_single.then(|| values.iter().map(|v| v.abs() * f64::from(f32::EPSILON)).collect());
    }
    // Digits after the point are limited as well as significant ones, by one format or another.
    let last = written.iter().map(|(digits, exponent)| exponent - digits + 1).min()?;
    let step = |(_, exponent): &(i32, i32)| 10.0_f64.powi(last.max(exponent - most + 1));
    Some(written.iter().map(step).collect())
}

/// Significant digits of the shortest decimal number that is this one, and the exponent of its first.
fn digits(value: f64) -> (i32, i32) {
    let text = format!("{value:e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let digits = mantissa.chars().filter(char::is_ascii_digit).count();
    (i32::try_from(digits).unwrap_or(ALL), exponent.parse().unwrap_or(0))
}

/// The next larger number of two digits.
fn two_digits_up(value: f64) -> f64 {
    let unit = 10.0_f64.powf(value.log10().floor() - 1.0);
    (value / unit).ceil() * unit
}

/// What is rounded, to what.
fn what(found: &[Rounded]) -> String {
    let names: Vec<String> = found.iter().map(|of| of.output.clone()).collect();
    let step = found.iter().map(|of| of.step).fold(0.0, f64::max);
    format!("the solver rounds {} (to {})", quoted_list(&names), rounded(step, 2))
}

/// What points bring that are too close together.
const DANGER: &str =
    "rounding looks like information: intervals may be far too narrow and estimates anywhere";

fn hopeless(found: &[Rounded]) -> String {
    format!(
        "{}, which is coarse beside the noise: however far apart points are placed, {DANGER}. Let it print more digits (%.17g).",
        what(found)
    )
}

fn told(found: &[Rounded], [usual, wanted]: [f64; 2], is_given: bool) -> String {
    let (what, usual, wanted) = (what(found), rounded(usual, 2), rounded(wanted, 2));
    if is_given {
        return format!(
            "{what}, and [estimator] spread = {usual} places the points so close together that {DANGER}. Let it print more digits (%.17g), or \
             give spread = {wanted}, or none."
        );
    }
    format!(
        "{what}: points {usual} apart would differ by little more than that, so they are placed up to {wanted} apart, as spread = {wanted} in \
         [estimator] would. With more digits (%.17g) that is not needed."
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn courses(round: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..40).map(|k| round(20.0 + 7.0 * (0.37 * f64::from(k)).sin())).collect()
    }

    #[test]
    fn decimals_significant_digits_and_single_precision_are_told_by_the_numbers() {
        let all = |values: Vec<f64>, step: f64| {
            let steps = steps(&values).expect("rounded");
            assert!(steps.iter().all(|s| (s / step - 1.0).abs() < 1e-9), "{step}: {steps:?}");
        };
        all(courses(|v| (v * 1e3).round() / 1e3), 1e-3);
        all(courses(|v| format!("{v:.5e}").parse().expect("a number")), 1e-4);
        all(courses(f64::round), 1.0);
        let single = steps(&courses(|v| f64::from(v as f32))).expect("rounded");
        assert!(single.iter().all(|s| (1e-6..4e-6).contains(s)), "{single:?}");
        // Small and large numbers with six digits each.
        let wide: Vec<f64> = (0..20)
            .map(|k| format!("{:.5e}", 1.234_567_89 * 10f64.powi(k - 10)).parse().expect("a number"))
            .collect();
        let wide = steps(&wide).expect("rounded");
        assert!((wide[0] / 1e-15 - 1.0).abs() < 1e-9 && (wide[19] / 1e4 - 1.0).abs() < 1e-9, "{wide:?}");
    }

    #[test]
    fn numbers_with_all_their_digits_or_of_a_thing_at_rest_are_not_rounded() {
        assert!(steps(&courses(|v| v)).is_none());
        assert!(steps(&[20.0; 40]).is_none(), "at rest");
        assert!(steps(&courses(|v| v)[..4]).is_none());
        assert!(steps(&courses(|v| if v > 26.0 { f64::NAN } else { v.round() })).is_none());
    }

    #[test]
    fn the_distance_is_given_with_two_digits_and_no_less() {
        assert!((two_digits_up(0.009_61) - 0.0097).abs() < 1e-12);
        assert!((two_digits_up(1.0) - 1.0).abs() < 1e-12);
    }
}
