//! The figures of a run's report, one file per kind.
//!
//! A new one is a file with `figures(&ReportData)` and its line in [`SLOTS`], where it is a section of its own unless
//! `report.html` names it. Next file to read: [`fit`].

mod along;
mod autocorrelation;
mod field_map;
pub(crate) mod fit;
mod nis;
mod observer;
mod pairs;
mod predicted;
mod residual;
mod run_times;
mod track;

use crate::ReportError;
use crate::data::ReportData;
use crate::plot::figure::{Figure, Slot, Slots};

type Draw = fn(&ReportData) -> Vec<Figure>;

/// The places for figures, in the order of their sections, and what draws the figures of each.
const SLOTS: [Slot<Draw>; 9] = [
    Slot::named("families", along::figures),
    Slot::named("fit", fit::figures),
    Slot::named("predicted", predicted::figures),
    Slot::section(
        "residuals",
        "What the residuals have in common",
        "No residuals were stored.",
        residual::figures,
    ),
    Slot::section("tracks", "Parameters over the run", "No analyses were stored.", track::figures),
    Slot::named("pairs", pairs::figures),
    Slot::named("nis", nis::figures),
    Slot::named("observer", observer::figures),
    Slot::named("run_times", run_times::figures),
];

/// Draws every figure of the page.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn draw(data: &ReportData) -> Result<Slots, ReportError> {
    Slots::draw(&SLOTS, |draw| draw(data))
}
