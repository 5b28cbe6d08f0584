//! The figures of a diagnosis, one file per kind.
//!
//! A new one is a file with `figures(&Diagnosed)` and its line in [`SLOTS`], which `diagnose.html` sets. Next file to read: [`courses`].

mod courses;

use starlings_diagnose::Diagnosed;

use crate::ReportError;
use crate::plot::figure::{Figure, Slot, Slots};

type Draw = fn(&Diagnosed) -> Vec<Figure>;

/// The places for figures, in the order of their sections, and what draws the figures of each.
const SLOTS: [Slot<Draw>; 1] = [Slot::named("courses", courses::figures)];

/// Draws every figure of the page.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn draw(found: &Diagnosed) -> Result<Slots, ReportError> {
    Slots::draw(&SLOTS, |draw| draw(found))
}
