//! The 95 % intervals of a parameter before and after the data, as two bars on one line.
//!
//! The bars are placed by [`Axis`], which plotters has no logarithmic equal of; a chart would add axes that the row has no room for.

use plotters::element::Rectangle;
use plotters::style::{Color, RGBColor};

use super::super::ReportError;
use super::super::data::ParameterRow;
use super::axis::Axis;
use super::palette::{BLUE, GREY, INK};
use super::scene::{Surface, picture, units};

/// Size of the graphic of a table row, in figure units.
const STRIP: (i32, i32) = (170, 24);

/// The graphic of one table row, as an SVG element.
///
/// # Errors
///
/// The graphic cannot be drawn.
pub(crate) fn strip(row: &ParameterRow, log: bool) -> Result<String, ReportError> {
    let title = format!("{}: prior and posterior interval", row.name);
    let description = "Grey: prior 95\u{a0}% interval with its median. Blue: posterior 95\u{a0}% interval.";
    let area = BarArea { left: units(4), right: units(STRIP.0 - 4), middle: units(STRIP.1 / 2) };
    picture(STRIP, &title, description, |surface| draw(surface, row, log, area))
}

/// Where two bars are drawn, in drawing units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BarArea {
    pub(crate) left: i32,
    pub(crate) right: i32,
    pub(crate) middle: i32,
}

/// Draws both intervals of one parameter; what is not finite is left out.
///
/// # Errors
///
/// The drawing library refuses a bar.
pub(crate) fn draw(
    surface: &Surface<'_>,
    row: &ParameterRow,
    log: bool,
    area: BarArea,
) -> Result<(), ReportError> {
    let ends = [row.prior_lo, row.prior_hi, row.prior_median, row.lo, row.hi, row.estimate];
    let axis = if log { Axis::log_around("", ends) } else { Axis::around("", ends) };
    let (lo, hi) = axis.ends();
    let pixel = |value: f64| {
        let share = (axis.at(value.clamp(axis.lo, axis.hi)) - lo) / (hi - lo);
        area.left + (share * f64::from(area.right - area.left)).round() as i32
    };
    let bar = |from: f64, to: f64, half: i32, colour: RGBColor, least: i32| {
        if !(from.is_finite() && to.is_finite()) {
            return Ok(());
        }
        let (left, right) = (pixel(from), pixel(to).max(pixel(from) + least));
        let corners = [(left, area.middle - half), (right, area.middle + half)];
        surface.draw(&Rectangle::new(corners, colour.filled())).map_err(ReportError::drawing)
    };
    bar(row.prior_lo, row.prior_hi, units(2), GREY, 0)?;
    bar(row.prior_median, row.prior_median, units(7), INK, units(1))?;
    bar(row.lo, row.hi, units(6), BLUE, units(3))
}
