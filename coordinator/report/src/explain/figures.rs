//! The figures of an explanation, one file per kind.
//!
//! A new one is a file with `figures(&Explanation, &Figures)`, its line in [`SLOTS`], and its slot in `explain/explain.html`. Next
//! file to read: [`course`].

mod alarm;
pub(super) mod course;
mod force;
mod region;
mod spectrum;

use starlings_explain::Figures;
use starlings_explain::result::Explanation;

use crate::ReportError;
use crate::plot::figure::{Figure, Slots};

type Draw = fn(&Explanation, &Figures) -> Result<Vec<Figure>, ReportError>;

/// Slots of the template, and what draws the figures of each.
const SLOTS: [(&str, Draw); 5] = [
    ("courses", course::figures),
    ("maps", region::figures),
    ("spectra", spectrum::figures),
    ("forces", force::figures),
    ("alarm", alarm::figures),
];

/// Draws every figure of the page.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn draw(found: &Explanation, data: &Figures) -> Result<Slots, ReportError> {
    SLOTS.iter().map(|(slot, draw)| Ok((*slot, draw(found, data)?))).collect()
}
