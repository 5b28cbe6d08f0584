//! The table of what was predicted and need not have been measured.

use serde::Serialize;
use starlings_study::predicted::{Figure, PredictedOutput};

use crate::data::ReportData;
use crate::number;

/// Rows at most.
const MOST: usize = 60;

/// One output over one record.
#[derive(Debug, Serialize)]
pub(super) struct PredictedView {
    output: String,
    unit: String,
    record: String,
    /// Mean, lowest and highest value with their intervals.
    figures: [(String, String); 3],
}

/// The first rows.
pub(super) fn rows(data: &ReportData) -> Vec<PredictedView> {
    data.predictions.iter().take(MOST).map(view).collect()
}

/// How many have no row.
pub(super) fn left_out(data: &ReportData) -> usize {
    data.predictions.len().saturating_sub(MOST)
}

fn view(row: &PredictedOutput) -> PredictedView {
    PredictedView {
        output: row.output.clone(),
        unit: row.unit.clone(),
        record: row.record.clone(),
        figures: row.figures().map(|(_, figure)| texts(figure)),
    }
}

fn texts(Figure { estimate, interval95: [lo, hi] }: Figure) -> (String, String) {
    // An interval of 95 % is about four sd long.
    let digits = |value| number::with_sd(value, 0.25 * (hi - lo));
    (digits(estimate), format!("{} to {}", digits(lo), digits(hi)))
}
