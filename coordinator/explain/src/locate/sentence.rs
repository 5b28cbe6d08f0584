//! Places in words with numbers.
//!
//! Next file to read: [`crate::number`].

use starlings_models::units::spaced;

use super::region::{Bound, Region};
use super::residuals::Residuals;
use super::signal::{Kind, Signal};
use crate::number::{percent, three, threshold};
use crate::rows::Usage;

/// The figures of a place.
pub(super) struct Figures {
    /// Root mean square of observed − predicted.
    pub(super) rmse: f64,
    /// What noise and the fit's uncertainty would leave.
    pub(super) expected: f64,
    /// Mean of observed − predicted.
    pub(super) bias: f64,
    /// Share of the channel's values.
    pub(super) share: f64,
}

/// The region in words, such as `flow > 50 mL/s`; the time is told by the place's span, except over several records.
pub(super) fn region_words(region: &Region, signals: &[Signal], several_records: bool) -> String {
    let words: Vec<String> = region
        .bounds
        .iter()
        .filter_map(|bound| match &signals[bound.signal].kind {
            Kind::Time if !several_records => None,
            Kind::RecordTime { record } => Some(format!("record {record}")),
            _ => Some(bound_words(bound, &signals[bound.signal])),
        })
        .collect();
    words.join(" and ")
}

fn bound_words(bound: &Bound, signal: &Signal) -> String {
    let name = if signal.kind == Kind::Size { format!("|{}|", signal.name) } else { signal.name.clone() };
    let unit = spaced(&signal.unit);
    let number = |v: f64| threshold(v, signal.range);
    match (bound.from.is_finite(), bound.to.is_finite()) {
        (true, true) => format!("{} < {name} < {}{unit}", number(bound.from), number(bound.to)),
        (true, false) => format!("{name} > {}{unit}", number(bound.from)),
        (false, true) => format!("{name} < {}{unit}", number(bound.to)),
        (false, false) => name,
    }
}

/// A span of time in words: from, to, or both.
fn span_words(bound: &Bound, signal: &Signal) -> String {
    let unit = spaced(&signal.unit);
    let number = |v: f64| threshold(v, signal.range);
    match (bound.from.is_finite(), bound.to.is_finite()) {
        (true, true) => format!("from t = {} to {}{unit}", number(bound.from), number(bound.to)),
        (true, false) => format!("after t = {}{unit}", number(bound.from)),
        (false, true) => format!("before t = {}{unit}", number(bound.to)),
        (false, false) => String::new(),
    }
}

/// Where the region is, as it follows the channel's name in a sentence.
fn place_words(region: &Region, signals: &[Signal]) -> String {
    let mut where_words = Vec::new();
    let mut when_words = Vec::new();
    for bound in &region.bounds {
        let signal = &signals[bound.signal];
        match &signal.kind {
            Kind::Time => when_words.push(span_words(bound, signal)),
            Kind::RecordTime { record } => {
                when_words
                    .push(format!("in record {record} {}", span_words(bound, signal)).trim_end().to_owned());
            }
            Kind::Track | Kind::Size => where_words.push(bound_words(bound, signal)),
        }
    }
    let mut words = when_words.join(" ");
    if !where_words.is_empty() {
        let joined = format!("where {}", where_words.join(" and "));
        words = if words.is_empty() { joined } else { format!("{words} {joined}") };
    }
    words
}

/// What is said of a place: the region is `None` for all of the channel, and `elsewhere` marks what other places left over.
pub(super) fn sentence(
    group: &Residuals,
    region: Option<(&Region, &[Signal])>,
    elsewhere: bool,
    figures: &Figures,
) -> String {
    let mut text = group.channel.clone();
    match group.usage {
        Usage::Train => {}
        Usage::HeldOut => text.push_str(" in the held-out span"),
        Usage::HeldOutChannel => text.push_str(" (never fitted)"),
    }
    if let Some((region, signals)) = region {
        text.push(' ');
        text.push_str(&place_words(region, signals));
    } else if elsewhere {
        text.push_str(" elsewhere");
    }
    if figures.share < 0.995 {
        text = format!("{text} ({} of the samples)", percent(figures.share));
    }
    let unit = spaced(&group.unit);
    let (rmse, expected) = (three(figures.rmse), three(figures.expected));
    text = format!("{text}: {rmse}{unit} rms against {expected} expected");
    if figures.bias.abs() > 0.5 * figures.rmse {
        let side = if figures.bias > 0.0 { "low" } else { "high" };
        text = format!("{text}; simulated too {side} by {}", three(figures.bias.abs()));
    }
    text
}
