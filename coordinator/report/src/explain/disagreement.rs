//! Where simulation and data disagree, in words and tables: places, channels, correlations.
//!
//! Next file to read: `candidates.rs`.

use serde::Serialize;
use starlings_explain::Figures;
use starlings_explain::locate::{ChannelGap, Correlated};
use starlings_explain::result::Explanation;

use super::probability;
use crate::number::{self, quantity};
use crate::plot::meter::{Bar, meter};
use crate::plot::palette::{ABOVE, BELOW, INK, MUTED};

/// Rows of the table of channels at most.
const ROWS: usize = 80;

/// Where the gap is, ready to be arranged.
#[derive(Debug, Serialize)]
pub(super) struct Disagreement {
    sentences: Vec<String>,
    channels: Vec<Vec<String>>,
    correlations: Vec<CorrelationRow>,
}

#[derive(Debug, Serialize)]
struct CorrelationRow {
    channel: String,
    with: String,
    coefficient: String,
    interval: String,
    meter: String,
}

impl Disagreement {
    /// Formats what locating found.
    pub(super) fn new(found: &Explanation, figures: &Figures) -> Self {
        let located = &figures.before;
        Self {
            sentences: found.places.iter().map(|place| place.sentence.clone()).collect(),
            channels: located.channels.iter().take(ROWS).map(channel).collect(),
            correlations: located.correlations.iter().map(correlation).collect(),
        }
    }
}

fn channel(c: &ChannelGap) -> Vec<String> {
    let digits = |value: f64| number::significant(value, 3);
    vec![
        c.channel.clone(),
        c.record.clone(),
        c.usage.replace("train", "training"),
        c.n.to_string(),
        format!("{} ({} to {})", quantity(c.rmse, &c.unit), digits(c.interval95[0]), digits(c.interval95[1])),
        digits(c.noise),
        digits(c.bias),
        number::with_sd(c.lag1, 0.1),
        probability(c.whiteness_p),
        number::significant(c.effective_n, 2),
    ]
}

fn correlation(c: &Correlated) -> CorrelationRow {
    let [lo, hi] = c.interval95;
    let colour = if c.coefficient > 0.0 { ABOVE } else { BELOW };
    let bars = [
        Bar { from: 0.0, to: c.coefficient, lane: (6, 18), colour },
        Bar { from: lo, to: hi, lane: (11, 13), colour: INK },
        Bar::tick(0.0, MUTED),
    ];
    let text = number::with_sd(c.coefficient, 0.1);
    let title = format!("{} with {}: {text}", c.channel, c.with);
    CorrelationRow {
        channel: c.channel.clone(),
        with: c.with.clone(),
        coefficient: text,
        interval: format!("{} to {}", number::with_sd(lo, 0.1), number::with_sd(hi, 0.1)),
        meter: meter(
            &title,
            "Bar: coefficient, from −1 to 1. Thin bar: 95\u{a0}% interval.",
            (-1.0, 1.0),
            &bars,
        ),
    }
}
