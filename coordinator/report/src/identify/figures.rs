//! The figures of an identifiability analysis, one file per kind.
//!
//! A new one is a file with `figures(&Identification)`, its line in [`SLOTS`], and its slot in `identify.html`. Next file to read:
//! [`sensitivity`].

mod collinearity;
mod generalised;
mod sensitivity;

use starlings_study::identify::Identification;

use crate::ReportError;
use crate::plot::figure::{Figure, Slots};

type Draw = fn(&Identification) -> Result<Vec<Figure>, ReportError>;

/// Slots of the template, and what draws the figures of each.
const SLOTS: [(&str, Draw); 3] = [
    ("sensitivity", sensitivity::figures),
    ("gsf", generalised::figures),
    ("collinearity", collinearity::figures),
];

/// Draws every figure of the page.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn draw(found: &Identification) -> Result<Slots, ReportError> {
    SLOTS.iter().map(|(slot, draw)| Ok((*slot, draw(found)?))).collect()
}
