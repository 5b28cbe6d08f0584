//! A small graphic for a row of a table: bars on one short scale.
//!
//! A row of a table has no room for axes. Next file to read: [`super::interval`].

use super::palette::Colour;
use super::svg::{head, rect};

/// Size, px.
const SIZE: (f64, f64) = (170.0, 24.0);

/// One bar of a meter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bar {
    /// Where it begins and ends, on the scale of the meter; left out when either is not finite.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Upper and lower edge, px.
    pub(crate) lane: (i32, i32),
    pub(crate) colour: Colour,
}

impl Bar {
    /// A thin upright stroke at one value.
    pub(crate) fn tick(at: f64, colour: Colour) -> Self {
        Self { from: at, to: at, lane: (3, 21), colour }
    }
}

/// Draws the bars, in order, on a scale from `ends.0` to `ends.1`.
pub(crate) fn meter(title: &str, description: &str, ends: (f64, f64), bars: &[Bar]) -> String {
    let (left, right) = (4.0, SIZE.0 - 4.0);
    // Halves, because the difference of the largest numbers overflows.
    let width = 0.5 * ends.1 - 0.5 * ends.0;
    let pixel = |value: f64| {
        let share = if width > 0.0 && width.is_finite() {
            ((0.5 * value - 0.5 * ends.0) / width).clamp(0.0, 1.0)
        } else {
            0.5
        };
        left + share * (right - left)
    };
    let mut text = head(
        &format!("viewBox=\"0 0 {} {}\" preserveAspectRatio=\"none\"", SIZE.0, SIZE.1),
        title,
        description,
    );
    for bar in bars.iter().filter(|bar| bar.from.is_finite() && bar.to.is_finite()) {
        let (from, to) = (pixel(bar.from.min(bar.to)), pixel(bar.from.max(bar.to)));
        let (upper, lower) = (f64::from(bar.lane.0), f64::from(bar.lane.1));
        let body = rect((from, upper), ((to - from).max(2.0), lower - upper), "area", 1.0);
        text.extend(["<g class=\"c ", bar.colour.name, "\">", &body, "</g>"]);
    }
    text + "</svg>"
}
