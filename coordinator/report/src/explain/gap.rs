//! The gap before and after: errors by channel and use, and what became of the model's own parameters.
//!
//! Where nothing was added there is only a before, which is shown. Next file to read: `disagreement.rs`.

use serde::Serialize;
use starlings_explain::Figures;
use starlings_explain::result::{Explanation, GapRow, ParameterShift};

use crate::number::{self, quantity};
use crate::plot::meter::{Bar, meter};
use crate::plot::palette::{BLUE, GREY, INK, VERMILION};

/// Rows of the table at most.
const ROWS: usize = 80;

/// The gap, ready to be arranged.
#[derive(Debug, Serialize)]
pub(super) struct Gap {
    rows: Vec<GapView>,
    rows_left_out: usize,
    compared: bool,
}

#[derive(Debug, Serialize)]
struct GapView {
    channel: String,
    record: String,
    usage: &'static str,
    before: String,
    after: String,
    change: String,
    noise: String,
    unit: String,
    meter: String,
}

impl Gap {
    /// Formats the errors.
    pub(super) fn new(found: &Explanation, figures: &Figures) -> Self {
        let rows = rows(found, figures);
        let view = |row: &GapRow| GapView::new(row, &rows, unit_of(&row.channel, figures));
        Self {
            rows: rows.iter().take(ROWS).map(view).collect(),
            rows_left_out: rows.len().saturating_sub(ROWS),
            compared: !found.effects.is_empty(),
        }
    }
}

impl GapView {
    fn new(row: &GapRow, rows: &[GapRow], unit: &str) -> Self {
        let same = rows.iter().filter(|other| other.channel == row.channel);
        let reach = same.flat_map(|other| [other.before, other.after, other.noise]);
        let longest = reach.filter(|v| v.is_finite()).fold(0.0, f64::max);
        let bar = |to, lane, colour| Bar { from: 0.0, to, lane, colour };
        let bars =
            [bar(row.before, (4, 11), VERMILION), bar(row.after, (13, 20), BLUE), Bar::tick(row.noise, INK)];
        let after = if row.after.is_finite() {
            format!("after {}", quantity(row.after, unit))
        } else {
            "nothing after".to_owned()
        };
        let title = format!(
            "{}, {}: before {}, {after}, noise {}",
            row.channel,
            words(&row.usage),
            quantity(row.before, unit),
            quantity(row.noise, unit)
        );
        let ratio = row.after / row.before;
        Self {
            channel: row.channel.clone(),
            record: row.record.clone(),
            usage: words(&row.usage),
            before: number::significant(row.before, 3),
            after: number::significant(row.after, 3),
            change: if ratio.is_finite() { format!("× {ratio:.2}") } else { number::ABSENT.to_owned() },
            noise: number::significant(row.noise, 3),
            unit: unit.to_owned(),
            meter: meter(
                &title,
                "Upper bar: before. Lower bar: after. Stroke: noise.",
                (0.0, longest),
                &bars,
            ),
        }
    }
}

/// The use of a channel in words.
pub(super) fn words(usage: &str) -> &'static str {
    match usage {
        "train" => "training",
        "held-out" => "held-out span",
        "held-out-channel" => "held-out channel",
        _ => "other",
    }
}

/// The errors before and after; where nothing was added, those of the model as it is.
pub(super) fn rows(found: &Explanation, figures: &Figures) -> Vec<GapRow> {
    if found.effects.is_empty() { as_it_is(figures) } else { found.gap.clone() }
}

/// The errors of the model as it is.
fn as_it_is(figures: &Figures) -> Vec<GapRow> {
    let row = |c: &starlings_explain::locate::ChannelGap| GapRow {
        record: c.record.clone(),
        channel: c.channel.clone(),
        unit: c.unit.clone(),
        usage: c.usage.clone(),
        before: c.rmse,
        after: f64::NAN,
        noise: c.noise,
    };
    figures.before.channels.iter().map(row).collect()
}

fn unit_of<'a>(channel: &str, figures: &'a Figures) -> &'a str {
    let of_curve = figures.curves.iter().find(|c| c.channel == channel).map(|c| c.unit.as_str());
    let of_gap = || figures.before.channels.iter().find(|c| c.channel == channel).map(|c| c.unit.as_str());
    of_curve.or_else(of_gap).unwrap_or("")
}

/// What happened to one parameter, ready to be arranged.
#[derive(Debug, Serialize)]
pub(super) struct ShiftRow {
    name: String,
    before: String,
    after: String,
    sd: String,
    shift: String,
    unit: String,
    meter: String,
}

impl ShiftRow {
    /// Formats one shift.
    pub(super) fn new(p: &ParameterShift) -> Self {
        let shift = (p.after - p.before) / p.sd;
        // One scale for all: a parameter that hardly moved must not look like one that moved far.
        let [moved, sd] = p.in_prior_sd.unwrap_or([f64::NAN; 2]);
        let bars = [
            Bar { from: 0.0, to: moved, lane: (11, 13), colour: GREY },
            Bar { from: moved - 2.0 * sd, to: moved + 2.0 * sd, lane: (7, 17), colour: BLUE },
            Bar::tick(0.0, VERMILION),
        ];
        let shift_text = if shift.is_finite() {
            let sign = if shift > 0.0 { "+" } else { "" };
            format!("{sign}{} sd", number::with_sd(shift, 1.0))
        } else {
            number::ABSENT.to_owned()
        };
        let title = format!("{}: shifted by {shift_text}", p.name);
        Self {
            name: p.name.clone(),
            before: number::with_sd(p.before, p.sd),
            after: number::with_sd(p.after, p.sd),
            sd: number::significant(p.sd, 2),
            shift: shift_text,
            unit: p.unit.clone(),
            meter: meter(
                &title,
                "In prior sd, from −4 to 4. Stroke: before. Bar: after, ± 2 sd.",
                (-4.0, 4.0),
                &bars,
            ),
        }
    }
}
