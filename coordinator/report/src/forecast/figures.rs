//! The figures of a forecast, one file per kind.
//!
//! A new one is a file with `figures(&Forecast)` and its line in [`SLOTS`], where it is a section of its own unless
//! `forecast.html` names it. Next file to read: [`fan`].

mod crossings;
mod fan;

use starlings_study::forecast::Forecast;

use crate::ReportError;
use crate::plot::figure::{Figure, Slot, Slots};

type Draw = fn(&Forecast) -> Vec<Figure>;

/// The places for figures, in the order of their sections, and what draws the figures of each.
const SLOTS: [Slot<Draw>; 2] = [
    Slot::named("crossings", crossings::figures),
    Slot::section("fan", "Courses", "Nothing was forecast.", fan::figures),
];

/// Draws every figure of the page.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn draw(found: &Forecast) -> Result<Slots, ReportError> {
    Slots::draw(&SLOTS, |draw| draw(found))
}
