//! Which constants the answer hangs on, as a table: the same in the report of a run and on the page of `identify`.
//!
//! Next file to read: [`starlings_study::constants`].

use serde::Serialize;
use starlings_study::constants::{ConstantEffect, HangsOn};

use super::number;

/// Rows of the table at most.
const ROWS: usize = 15;
/// Sentences above it at most.
const SENTENCES: usize = 3;

/// The section.
#[derive(Debug, Serialize)]
pub(crate) struct HangsOnView {
    says: Vec<String>,
    /// Constant, its value, the estimate that moves most, its move, the other estimates that move.
    rows: Vec<[String; 5]>,
    left_out: usize,
    not_tried: String,
    runs: u64,
}

/// The section, where there is something to show.
pub(crate) fn view(found: Option<&HangsOn>) -> Option<HangsOnView> {
    let found = found.filter(|found| found.runs > 0)?;
    Some(HangsOnView {
        says: found.sentences(SENTENCES),
        rows: found.constants.iter().take(ROWS).filter_map(row).collect(),
        left_out: found.constants.len().saturating_sub(ROWS),
        not_tried: found.not_tried.join(", "),
        runs: found.runs,
    })
}

fn row(constant: &ConstantEffect) -> Option<[String; 5]> {
    let signed = |sd: f64| number::with_sd(sd, if sd.abs() < 10.0 { 0.1 } else { 1.0 });
    let most = constant.moves.first()?;
    let others = constant.moves.iter().skip(1).filter(|m| m.sd_per_percent.abs() >= 0.1).take(3);
    let others: Vec<String> =
        others.map(|m| format!("{} {}", m.parameter, signed(m.sd_per_percent))).collect();
    Some([
        constant.constant.clone(),
        constant.value.map_or_else(|| number::ABSENT.to_owned(), |v| number::significant(v, 3)),
        most.parameter.clone(),
        signed(most.sd_per_percent),
        others.join(", "),
    ])
}
