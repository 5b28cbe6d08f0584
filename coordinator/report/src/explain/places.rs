//! Where simulation and data disagree: places, channels, operating regions, correlations, frequencies, unknown inputs.
//!
//! Next file to read: `candidates.rs`.

use serde::Serialize;
use starlings_explain::Figures;
use starlings_explain::locate::{ChannelGap, Correlated, Located, RegionMap, UnknownInput};
use starlings_explain::result::Explanation;

use super::probability;
use crate::ReportError;
use crate::number::{self, quantity};
use crate::plot::figure::Figure;
use crate::plot::meter::{Bar, meter};
use crate::plot::palette::{BLUE, INK, MUTED, VERMILION};
use crate::plot::{force, region, spectrum};

/// Maps, spectra and unknown inputs drawn at most.
const MAPS: usize = 10;
const SPECTRA: usize = 6;
const FORCES: usize = 8;
/// Rows of the table of channels at most.
const ROWS: usize = 80;

/// Where the gap is, ready to be arranged.
#[derive(Debug, Serialize)]
pub(super) struct Places {
    sentences: Vec<String>,
    channels: Vec<Vec<String>>,
    maps: Vec<Figure>,
    correlations: Vec<CorrelationRow>,
    spectra: Vec<Figure>,
    forces: Vec<Figure>,
}

#[derive(Debug, Serialize)]
struct CorrelationRow {
    channel: String,
    with: String,
    coefficient: String,
    interval: String,
    meter: String,
}

impl Places {
    /// Formats and draws what locating found.
    ///
    /// # Errors
    ///
    /// A figure cannot be drawn.
    pub(super) fn new(found: &Explanation, figures: &Figures) -> Result<Self, ReportError> {
        let located = &figures.before;
        let spectra = located.spectra.iter().take(SPECTRA);
        let spectra = spectra.filter_map(|s| spectrum::figure(s, &figures.time_unit).transpose());
        Ok(Self {
            sentences: found.places.iter().map(|place| place.sentence.clone()).collect(),
            channels: located.channels.iter().take(ROWS).map(channel).collect(),
            maps: maps(located, &figures.maps_after)?,
            correlations: located.correlations.iter().map(correlation).collect::<Result<_, _>>()?,
            spectra: spectra.collect::<Result<_, _>>()?,
            forces: forces(located, &figures.time_unit)?,
        })
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

/// The maps that account for most of the residuals, each beside itself with the effects.
fn maps(located: &Located, after: &[RegionMap]) -> Result<Vec<Figure>, ReportError> {
    let mut order: Vec<&RegionMap> = located.maps.iter().collect();
    order.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    let mut figures = Vec::new();
    for before in order.into_iter().take(MAPS) {
        let same = |m: &&RegionMap| m.channel == before.channel && m.x == before.x && m.y == before.y;
        let after = after.iter().find(same);
        let alike: Vec<&RegionMap> = [Some(before), after].into_iter().flatten().collect();
        let word = if after.is_some() { "before" } else { "the model as it is" };
        figures.extend(region::figure(before, word, &alike)?);
        if let Some(after) = after {
            figures.extend(region::figure(after, "after", &alike)?);
        }
    }
    Ok(figures)
}

fn correlation(c: &Correlated) -> Result<CorrelationRow, ReportError> {
    let [lo, hi] = c.interval95;
    let colour = if c.coefficient > 0.0 { VERMILION } else { BLUE };
    let bars = [
        Bar { from: 0.0, to: c.coefficient, lane: (6, 18), colour },
        Bar { from: lo, to: hi, lane: (11, 13), colour: INK },
        Bar::tick(0.0, MUTED),
    ];
    let text = number::with_sd(c.coefficient, 0.1);
    let title = format!("{} with {}: {text}", c.channel, c.with);
    Ok(CorrelationRow {
        channel: c.channel.clone(),
        with: c.with.clone(),
        coefficient: text,
        interval: format!("{} to {}", number::with_sd(lo, 0.1), number::with_sd(hi, 0.1)),
        meter: meter(
            &title,
            "Bar: coefficient, from −1 to 1. Thin bar: 95\u{a0}% interval.",
            (-1.0, 1.0),
            &bars,
        )?,
    })
}

/// The inputs that gain most, each against time and against its state.
fn forces(located: &Located, time_unit: &str) -> Result<Vec<Figure>, ReportError> {
    let mut order: Vec<&UnknownInput> = located.forces.iter().filter(|f| !f.time.is_empty()).collect();
    order.sort_by(|a, b| b.log_likelihood_gain.total_cmp(&a.log_likelihood_gain));
    let mut figures = Vec::new();
    for input in order.into_iter().take(FORCES) {
        figures.push(force::over_time(input, time_unit)?);
        figures.push(force::over_state(input)?);
    }
    Ok(figures)
}
