//! The 95 % intervals of a parameter before and after the data, as two bars on one line.
//!
//! A row of a table has no room for axes. Next file to read: [`super::meter`].

use super::super::data::ParameterRow;
use super::axis::Axis;
use super::palette::{BLUE, Colour, GREY, INK};
use super::svg::{head, rect};

/// Size of the graphic of a table row, px.
const STRIP: (f64, f64) = (170.0, 24.0);

/// The graphic of one table row, as an SVG element.
pub(crate) fn strip(row: &ParameterRow, log: bool) -> String {
    let title = format!("{}: prior and posterior interval", row.name);
    let description = "Grey: prior 95\u{a0}% interval with its median. Blue: posterior 95\u{a0}% interval.";
    let area = BarArea { left: 4.0, right: STRIP.0 - 4.0, middle: 0.5 * STRIP.1 };
    let view = format!("viewBox=\"0 0 {} {}\" preserveAspectRatio=\"none\"", STRIP.0, STRIP.1);
    head(&view, &title, description) + &bars(row, log, area) + "</svg>"
}

/// Where two bars are drawn, px.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BarArea {
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) middle: f64,
}

/// Both intervals of one parameter; what is not finite is left out.
pub(crate) fn bars(row: &ParameterRow, log: bool, area: BarArea) -> String {
    let ends = [row.prior_lo, row.prior_hi, row.prior_median, row.lo, row.hi, row.estimate];
    let axis = if log { Axis::log_around("", ends) } else { Axis::around("", ends) };
    let (lo, hi) = axis.ends();
    let pixel = |value: f64| {
        let at = axis.at(value.clamp(axis.lo, axis.hi));
        let share = (0.5 * at - 0.5 * lo) / (0.5 * hi - 0.5 * lo);
        area.left + share * (area.right - area.left)
    };
    let bar = |from: f64, to: f64, half: f64, colour: Colour, least: f64| {
        if !(from.is_finite() && to.is_finite()) {
            return String::new();
        }
        let (left, right) = (pixel(from), pixel(to).max(pixel(from) + least));
        let body = rect((left, area.middle - half), (right - left, 2.0 * half), "area", 1.0);
        format!("<g class=\"c {}\">{body}</g>", colour.name)
    };
    [
        bar(row.prior_lo, row.prior_hi, 2.0, GREY, 0.0),
        bar(row.prior_median, row.prior_median, 7.0, INK, 1.0),
        bar(row.lo, row.hi, 6.0, BLUE, 3.0),
    ]
    .concat()
}
