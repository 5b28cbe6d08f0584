//! The figures of a run's report, one file per kind.
//!
//! A new one is a file with `figures(&ReportData)`, its line in [`SLOTS`], and its slot in `report.html`. Next file to read:
//! [`fit`].

mod along;
mod autocorrelation;
mod field_map;
pub(crate) mod fit;
mod nis;
mod observer;
mod residual;
mod run_times;
mod track;

use crate::ReportError;
use crate::data::ReportData;
use crate::plot::figure::{Figure, Slots};

type Draw = fn(&ReportData) -> Result<Vec<Figure>, ReportError>;

/// Slots of the template, and what draws the figures of each.
const SLOTS: [(&str, Draw); 7] = [
    ("families", along::figures),
    ("fits", fit::figures),
    ("residuals", residual::figures),
    ("tracks", track::figures),
    ("nis", nis::figures),
    ("observer", observer::figures),
    ("run_times", run_times::figures),
];

/// Draws every figure of the page.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn draw(data: &ReportData) -> Result<Slots, ReportError> {
    SLOTS.iter().map(|(slot, draw)| Ok((*slot, draw(data)?))).collect()
}
