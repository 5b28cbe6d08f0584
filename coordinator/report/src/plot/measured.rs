//! Measured values and the spans of a record that were fitted or held out, as marks.

use super::axis::Axis;
use super::mark::Mark;
use super::palette::{Colour, MUTED, PURPLE, SHADE};
use super::thin;

/// At most this many measured values are drawn as dots.
const DOTS: usize = 160;

/// The training span and the words above both spans.
pub(crate) fn spans(trained: Option<[f64; 2]>, x: &Axis) -> Vec<Mark> {
    let Some([from, to]) = trained else {
        return vec![Mark::Heading { x: x.lo, text: "held out".to_owned(), colour: PURPLE }];
    };
    let (from, to) = (from.clamp(x.lo, x.hi), to.clamp(x.lo, x.hi));
    let mut marks = vec![Mark::Span { from, to, colour: SHADE }];
    let room = |width: f64| width > 0.22 * (x.hi - x.lo);
    if room(to - from) {
        marks.push(Mark::Heading { x: from, text: "training".to_owned(), colour: MUTED });
    }
    if room(x.hi - to) {
        marks.push(Mark::Heading { x: to, text: "held out".to_owned(), colour: PURPLE });
    }
    marks
}

/// Measured values: dots when they are few, otherwise a curve.
pub(crate) fn measured(time: &[f64], value: &[f64], colour: Colour) -> Vec<Mark> {
    let known: Vec<_> = time.iter().copied().zip(value.iter().copied()).filter(|p| p.1.is_finite()).collect();
    if drawn_as_dots(time) {
        return vec![Mark::Dots { points: known, colour, radius: 2.25 }];
    }
    thin::parts(time, value, value)
        .iter()
        .map(|part| match thin::curve(part) {
            points if points.len() < 2 => Mark::Dots { points, colour, radius: 1.75 },
            points => Mark::Line { points, colour, width: 1.25 },
        })
        .collect()
}

/// Whether [`measured`] draws a series at these times as dots.
pub(crate) fn drawn_as_dots(time: &[f64]) -> bool {
    time.len() <= DOTS
}

/// The legend's sample for what [`measured`] draws in ink.
pub(crate) fn measured_key(time: &[f64]) -> &'static str {
    if drawn_as_dots(time) { "dot ink" } else { "line ink" }
}
