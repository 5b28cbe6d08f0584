//! The figures of an explanation, one file per kind.
//!
//! A new one is a file with `figures(&Explanation, &Figures)` and its line in [`SLOTS`], where it is a section of its own unless
//! `explain/explain.html` names it. Next file to read: [`course`].

mod alarm;
pub(super) mod course;
mod force;
mod region;
mod spectrum;

use starlings_explain::Figures;
use starlings_explain::result::Explanation;

use crate::ReportError;
use crate::plot::figure::{Figure, Slot, Slots};

type Draw = fn(&Explanation, &Figures) -> Vec<Figure>;

/// The places for figures, in the order of their sections, and what draws the figures of each.
const SLOTS: [Slot<Draw>; 5] = [
    Slot::named("courses", course::figures),
    Slot::named("maps", region::figures),
    Slot::named("spectra", spectrum::figures),
    Slot::named("forces", force::figures),
    Slot::named("alarm", alarm::figures),
];

/// Draws every figure of the page.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn draw(found: &Explanation, data: &Figures) -> Result<Slots, ReportError> {
    Slots::draw(&SLOTS, |draw| draw(found, data))
}
