//! What was tried and what became of it, and how often chance would have given a name.

use serde::Serialize;
use starlings_explain::Figures;
use starlings_explain::result::{Explanation, FalseAlarm, Nulls, Screened};

use crate::number::{self, quantity};
use crate::plot::meter::{Bar, meter};
use crate::plot::palette::{BLUE, GREY};

/// Candidates listed at most.
const LISTED: usize = 80;

/// The candidates, ready to be arranged.
#[derive(Debug, Serialize)]
pub(super) struct Candidates {
    screened: Vec<CandidateRow>,
    left_out: usize,
    alarm_facts: Vec<(&'static str, String)>,
    measured: Option<String>,
}

#[derive(Debug, Serialize)]
struct CandidateRow {
    name: String,
    at: String,
    share: String,
    gain: String,
    amplitude: String,
    identifiable: String,
    fate: String,
    meter: String,
}

impl Candidates {
    /// Formats the candidates.
    pub(super) fn new(found: &Explanation, figures: &Figures) -> Self {
        Self {
            screened: found.screened.iter().take(LISTED).map(row).collect(),
            left_out: found.screened.len().saturating_sub(LISTED),
            alarm_facts: alarm_facts(&found.false_alarm, figures.best_gain),
            measured: found.false_alarm.nulls.as_ref().map(measured),
        }
    }
}

fn row(s: &Screened) -> CandidateRow {
    let bars = [
        Bar { from: 0.0, to: s.share.max(0.0), lane: (6, 18), colour: BLUE },
        Bar { from: 0.0, to: s.identifiable, lane: (10, 14), colour: GREY },
    ];
    let title = format!("{}: explains {} of the gap", s.name, number::percent(s.share));
    CandidateRow {
        name: s.name.clone(),
        at: s.at.clone(),
        share: number::percent(s.share),
        gain: quantity(s.gain, ""),
        amplitude: quantity(s.amplitude.unwrap_or(f64::NAN), ""),
        identifiable: number::percent(s.identifiable),
        fate: s.fate.clone(),
        meter: meter(&title, "Wide bar: share of the gap. Thin bar: identifiable part.", (0.0, 1.0), &bars),
    }
}

fn alarm_facts(alarm: &FalseAlarm, best: f64) -> Vec<(&'static str, String)> {
    vec![
        ("False-alarm rate of this search", percent(alarm.rate)),
        ("Its upper 95\u{a0}% limit", percent(alarm.upper95)),
        ("Simulations behind it", alarm.runs.to_string()),
        ("Threshold", quantity(alarm.threshold, "")),
        ("Best candidate", quantity(best, "")),
        ("Decoys that score as well", percent(alarm.decoys)),
    ]
}

/// The rate as the whole search was seen to have it.
fn measured(nulls: &Nulls) -> String {
    format!(
        "Measured: {} of {} simulated recordings without a gap got a name (at most {} with 95\u{a0}% confidence).",
        nulls.names,
        nulls.of,
        percent(nulls.upper95)
    )
}

/// A share in percent, to its first decimal.
fn percent(share: f64) -> String {
    if share.is_finite() {
        format!("{} %", number::with_sd(100.0 * share, 1.0))
    } else {
        number::ABSENT.to_owned()
    }
}
