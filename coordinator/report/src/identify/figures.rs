//! The figures of an identifiability analysis, one file per kind.
//!
//! A new one is a file with `figures(&Identification)` and its line in [`SLOTS`], where it is a section of its own unless
//! `identify.html` names it. Next file to read: [`sensitivity`].

mod collinearity;
mod generalised;
mod sensitivity;

use starlings_study::identify::Identification;

use crate::ReportError;
use crate::plot::figure::{Figure, Slot, Slots};

type Draw = fn(&Identification) -> Vec<Figure>;

/// The places for figures, in the order of their sections, and what draws the figures of each.
const SLOTS: [Slot<Draw>; 3] = [
    Slot::named("sensitivity", sensitivity::figures),
    Slot::section(
        "gsf",
        "Generalised sensitivities",
        "These data determine no parameter by themselves.",
        generalised::figures,
    ),
    Slot::named("collinearity", collinearity::figures),
];

/// Draws every figure of the page.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn draw(found: &Identification) -> Result<Slots, ReportError> {
    Slots::draw(&SLOTS, |draw| draw(found))
}
