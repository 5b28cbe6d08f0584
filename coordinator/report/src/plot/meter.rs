//! A small graphic for a row of a table: bars on one short scale.
//!
//! The scale is our own because a chart of plotters has room for axes and labels, and rounds pixels in another way.

use plotters::element::Rectangle;
use plotters::style::{Color, RGBColor};

use super::super::ReportError;
use super::scene::{picture, units};

/// Size, in figure units.
const SIZE: (i32, i32) = (170, 24);

/// One bar of a meter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bar {
    /// Where it begins and ends, on the scale of the meter; left out when either is not finite.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Upper and lower edge, in figure units.
    pub(crate) lane: (i32, i32),
    pub(crate) colour: RGBColor,
}

impl Bar {
    /// A thin upright stroke at one value.
    pub(crate) fn tick(at: f64, colour: RGBColor) -> Self {
        Self { from: at, to: at, lane: (3, 21), colour }
    }
}

/// Draws the bars, in order, on a scale from `ends.0` to `ends.1`.
///
/// # Errors
///
/// The graphic cannot be drawn.
pub(crate) fn meter(
    title: &str,
    description: &str,
    ends: (f64, f64),
    bars: &[Bar],
) -> Result<String, ReportError> {
    let (left, right) = (units(4), units(SIZE.0 - 4));
    // Halves, because the difference of the largest numbers overflows.
    let width = 0.5 * ends.1 - 0.5 * ends.0;
    let pixel = |value: f64| {
        let share = if width > 0.0 && width.is_finite() {
            ((0.5 * value - 0.5 * ends.0) / width).clamp(0.0, 1.0)
        } else {
            0.5
        };
        left + (share * f64::from(right - left)).round() as i32
    };
    picture(SIZE, title, description, |surface| {
        for bar in bars.iter().filter(|bar| bar.from.is_finite() && bar.to.is_finite()) {
            let (from, to) = (pixel(bar.from.min(bar.to)), pixel(bar.from.max(bar.to)));
            let corners = [(from, units(bar.lane.0)), (to.max(from + units(2)), units(bar.lane.1))];
            let element = Rectangle::new(corners, bar.colour.filled());
            surface.draw(&element).map_err(ReportError::drawing)?;
        }
        Ok(())
    })
}
