//! The figures of an inference, one file per kind.
//!
//! A new one is a file with `figures(&Inference)` and its line in [`SLOTS`]. Next file to read: [`convergence`].

mod convergence;

use starlings_infer::Inference;

use crate::ReportError;
use crate::plot::figure::{Figure, Slot, Slots};

type Draw = fn(&Inference) -> Vec<Figure>;

/// The places for figures, in the order of their sections, and what draws the figures of each.
const SLOTS: [Slot<Draw>; 1] = [Slot::section(
    "convergence",
    "Convergence",
    "The recordings are too short for an estimate of a part of them.",
    convergence::figures,
)];

/// Draws every figure of the page.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn draw(found: &Inference) -> Result<Slots, ReportError> {
    Slots::draw(&SLOTS, |draw| draw(found))
}
