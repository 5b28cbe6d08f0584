//! From a prior as written to a Gaussian in transformed units.
//!
//! A median is in physical units. The spread is a `factor` (a ratio of values, or of odds under a logit) or an `sd` (in
//! transformed units, which for `linear` are the physical ones). Next file to read: [`crate::expand`].

use starlings_estimators::{Drift, Transform};
use starlings_models::Quantity;
use toml::Spanned;

use super::median::{check_mean, check_median};
use crate::file::{ParameterSection, PriorSection, ProcessSection};
use crate::problem::Source;

/// A prior without its place: the median may have to come from a recording.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prior {
    pub(crate) transform: Transform,
    /// Mean in transformed units, when the study gives the median.
    pub(crate) mean: Option<f64>,
    /// Standard deviation in transformed units.
    pub(crate) sd: f64,
    /// How the parameter moves from one analysis to the next.
    pub(crate) drift: Drift,
}

/// Checks a prior against itself and against what the model says of the quantity. `None` when a problem was reported.
pub(crate) fn prior(
    source: &Source,
    parameter: &ParameterSection,
    quantity: Option<&Quantity>,
) -> Option<Prior> {
    let written = &parameter.prior;
    let before = source.count();
    let transform = transform(source, written);
    let sd = transform.and_then(|t| spread(source, written, &t));
    if let (Some(mean), Some(t)) = (&written.mean, transform) {
        check_mean(source, written, mean, &t, sd);
    }
    if let (Some(t), Some(q)) = (transform, quantity) {
        check_bounds(source, written, &t, q);
    }
    let mean = match (written.middle(), &written.median_from) {
        (Some(median), None) => transform.and_then(|t| {
            check_median(source, median, parameter.name.get_ref(), &t, quantity)
                .then(|| t.to_transformed(*median.get_ref()))
        }),
        (None, Some(_)) => None,
        (Some(_), Some(from)) => {
            source.report_with(
                from.span(),
                "`median` and `median_from` exclude each other",
                "keep one of them",
            );
            None
        }
        (None, None) => {
            source.report_with(
                written.span.clone(),
                format!("the prior of `{}` needs a median", parameter.name.get_ref()),
                "give `median = ...` in the parameter's unit, or `median_from = \"<output>\"` for the first value of a channel",
            );
            None
        }
    };
    let drift = drift(source, &parameter.process);
    (source.count() == before).then_some(Prior { transform: transform?, mean, sd: sd?, drift })
}

/// The transform as written: a name, or `logit(lo, hi)`.
fn transform(source: &Source, prior: &PriorSection) -> Option<Transform> {
    let Some(written) = &prior.transform else {
        source.report_with(
            prior.span.clone(),
            "the prior needs a transform",
            "transform = \"log\" for positive values, \"logit(lo, hi)\" between bounds, \"linear\" for any value",
        );
        return None;
    };
    let text = written.get_ref().trim();
    let (name, arguments) = text.split_once('(').map_or((text, None), |(n, a)| (n.trim(), Some(a)));
    let bounds = bounds(source, prior, written, arguments);
    match (name, arguments) {
        ("log", None) => Some(Transform::Log),
        ("log2", None) => Some(Transform::Log2),
        ("linear", None) => Some(Transform::Linear),
        ("logit", _) => logit(source, written, bounds?),
        _ => {
            let valid: Vec<String> = Transform::NAMES.iter().map(|n| (*n).to_owned()).collect();
            source.report_unknown(written.span(), format!("unknown transform `{text}`"), &valid);
            None
        }
    }
}

/// Bounds of a logit, from its arguments or from `lo` and `hi`.
fn bounds(
    source: &Source,
    prior: &PriorSection,
    written: &Spanned<String>,
    arguments: Option<&str>,
) -> Option<(f64, f64)> {
    let is_logit = written.get_ref().trim_start().starts_with("logit");
    if let Some(bound) = prior.lo.as_ref().or(prior.hi.as_ref()).filter(|_| !is_logit) {
        source.report_with(
            bound.span(),
            format!("`lo` and `hi` belong to the logit transform, this one is \"{}\"", written.get_ref()),
            "use transform = \"logit\" for a value between bounds",
        );
    }
    let from_arguments = arguments.and_then(|a| {
        let (lo, hi) = a.strip_suffix(')')?.split_once(',')?;
        Some((lo.trim().parse().ok()?, hi.trim().parse().ok()?))
    });
    let from_keys = prior.lo.as_ref().zip(prior.hi.as_ref()).map(|(lo, hi)| (*lo.get_ref(), *hi.get_ref()));
    let bounds = from_arguments.or(from_keys);
    if is_logit && bounds.is_none() {
        source.report_with(
            written.span(),
            format!("`{}` needs its two bounds", written.get_ref()),
            "write \"logit(0, 1)\", or give `lo` and `hi`",
        );
    }
    bounds
}

fn logit(source: &Source, written: &Spanned<String>, (lo, hi): (f64, f64)) -> Option<Transform> {
    if lo < hi && (hi - lo).is_finite() {
        return Some(Transform::Logit { lo, hi });
    }
    source.report(
        written.span(),
        format!("the bounds of a logit must be finite and increase, found {lo} and {hi}"),
    );
    None
}

/// Standard deviation in transformed units.
fn spread(source: &Source, prior: &PriorSection, transform: &Transform) -> Option<f64> {
    match (&prior.factor, &prior.sd) {
        (Some(factor), None) => factor_to_sd(source, factor, transform),
        (None, Some(sd)) if *sd.get_ref() > 0.0 => Some(*sd.get_ref()),
        (None, Some(sd)) => {
            source.report(sd.span(), format!("the prior's `sd` must be above zero, found {}", sd.get_ref()));
            None
        }
        (Some(factor), Some(_)) => {
            source.report_with(factor.span(), "`factor` and `sd` exclude each other", "keep one of them");
            None
        }
        (None, None) => {
            let help = match transform {
                Transform::Linear => "give `sd = ...` in the parameter's unit",
                _ => "give `factor = 2.0` for one standard deviation of a factor of two",
            };
            source.report_with(prior.span.clone(), "the prior needs a spread", help);
            None
        }
    }
}

fn factor_to_sd(source: &Source, factor: &Spanned<f64>, transform: &Transform) -> Option<f64> {
    let value = *factor.get_ref();
    if matches!(transform, Transform::Linear) {
        source.report_with(
            factor.span(),
            "a linear prior has no `factor`",
            "give `sd = ...` in the parameter's unit, or use transform = \"log\"",
        );
        return None;
    }
    if value <= 1.0 {
        source.report_with(
            factor.span(),
            format!("the prior's `factor` must be above 1, found {value}"),
            "factor = 2.0 means: one standard deviation is a factor of two up or down",
        );
        return None;
    }
    Some(if matches!(transform, Transform::Log2) { value.log2() } else { value.ln() })
}

/// A transform may not reach values that are physically impossible for certain.
fn check_bounds(source: &Source, prior: &PriorSection, transform: &Transform, quantity: &Quantity) {
    let [lowest, highest] = quantity.range;
    if let (Transform::Logit { lo, hi }, Some(written)) = (transform, &prior.transform) {
        // The bounds themselves are not reached: a lower bound of zero suits a value that must be above zero.
        let only_positive = (0.0..=f64::MIN_POSITIVE).contains(&lowest);
        let too_low = if only_positive { *lo < 0.0 } else { *lo < lowest };
        if too_low || *hi > highest {
            source.report_with(
                written.span(),
                format!(
                    "the bounds {lo} and {hi} reach outside the model's range ({})",
                    quantity.range_text()
                ),
                "narrow the bounds of the logit",
            );
        }
    }
}

/// A linear prior that reaches values outside the model's range makes sigma points that fail.
pub(crate) fn reach_warning(name: &str, prior: &Prior, quantity: &Quantity) -> Option<String> {
    let mean = prior.mean.filter(|_| matches!(prior.transform, Transform::Linear))?;
    let (low, high) = (mean - 2.0 * prior.sd, mean + 2.0 * prior.sd);
    (low < quantity.range[0] || high > quantity.range[1]).then(|| {
        format!(
            "the linear prior of `{name}` reaches from {low} to {high} within two sd, beyond the model's range ({}): \
             use a log or logit transform.",
            quantity.range_text()
        )
    })
}

/// How the parameter moves from one analysis to the next.
fn drift(source: &Source, process: &ProcessSection) -> Drift {
    match (&process.forgetting, &process.walk) {
        (None, None) => Drift::None,
        (Some(_), Some(walk)) => {
            source.report_with(walk.span(), "`forgetting` and `walk` exclude each other", "keep one of them");
            Drift::None
        }
        (Some(forgetting), None) => {
            let value = *forgetting.get_ref();
            if !(value > 0.0 && value <= 1.0) {
                source.report_with(
                    forgetting.span(),
                    format!("`forgetting` must be above 0 and at most 1, found {value}"),
                    "0.98 remembers about 50 analyses",
                );
            }
            Drift::Forgetting(value)
        }
        (None, Some(walk)) => {
            let value = *walk.get_ref();
            if value <= 0.0 {
                source.report(walk.span(), format!("`walk` must be above zero, found {value}"));
            }
            Drift::Walk(value)
        }
    }
}
