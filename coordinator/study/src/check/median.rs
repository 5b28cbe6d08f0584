//! The middle of a prior: its median, or its mean where that is the same.
//!
//! Next file to read: [`super::prior`].

use starlings_estimators::Transform;
use starlings_models::Quantity;
use starlings_models::units::rounded;
use toml::Spanned;

use crate::file::PriorSection;
use crate::problem::Source;

/// Refuses a mean where it is not the median, or stands beside one.
pub(super) fn check_mean(
    source: &Source,
    prior: &PriorSection,
    mean: &Spanned<f64>,
    transform: &Transform,
    sd: Option<f64>,
) {
    if prior.median.is_some() {
        source.report_with(mean.span(), "`median` and `mean` exclude each other", "keep one of them");
        return;
    }
    // Of a log-normal, E x = median exp(sd²/2), with sd of the natural logarithm (Johnson, Kotz & Balakrishnan 1994, ch. 14).
    let of_logarithm = match transform {
        Transform::Linear => return,
        Transform::Log => sd,
        Transform::Log2 => sd.map(|sd| sd * std::f64::consts::LN_2),
        Transform::Logit { .. } => None,
    };
    let help = of_logarithm.map_or_else(
        || "write `median`: the value that lies in the middle of the probability".to_owned(),
        |sd| {
            let median = rounded(mean.get_ref() * (-0.5 * sd * sd).exp(), 3);
            format!(
                "write `median`; with this spread the mean is {} where the median is {median}",
                mean.get_ref()
            )
        },
    );
    let message =
        format!("a prior with the transform {} has a median, which is not its mean", transform.name());
    source.report_with(mean.span(), message, help);
}

/// Whether a median can be transformed and lies in the range of its quantity; otherwise it is reported.
pub(crate) fn check_median(
    source: &Source,
    median: &Spanned<f64>,
    name: &str,
    transform: &Transform,
    quantity: Option<&Quantity>,
) -> bool {
    let value = *median.get_ref();
    if !transform.contains(value) {
        let (message, help) = match transform {
            Transform::Logit { lo, hi } => (
                format!("the prior median {value} of `{name}` must lie between {lo} and {hi}"),
                "move the median or the bounds of the logit",
            ),
            _ => (
                format!(
                    "the prior median {value} of `{name}` must be above zero for a {} transform",
                    transform.name()
                ),
                "use transform = \"linear\" with `sd` for a value that may be zero or negative",
            ),
        };
        source.report_with(median.span(), message, help);
        return false;
    }
    if let Some(q) = quantity.filter(|q| value < q.range[0] || value > q.range[1]) {
        let message =
            format!("the prior median {value} of `{name}` is outside the model's range ({})", q.range_text());
        source.report_with(median.span(), message, "give a median that physics allows");
        return false;
    }
    true
}
