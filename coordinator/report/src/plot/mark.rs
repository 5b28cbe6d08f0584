//! What can be drawn on two axes.
//!
//! Plain data, our own because the elements of plotters are bound to a backend and cannot be kept in a list.

use plotters::style::RGBColor;

use super::thin;

/// A point in the units of the axes.
pub(crate) type Point = (f64, f64);

/// One drawn thing; later marks lie on top of earlier ones. Values that are not finite are left out.
#[derive(Debug, Clone)]
pub(crate) enum Mark {
    /// A vertical region over the whole height.
    Span { from: f64, to: f64, colour: RGBColor },
    /// The region between two curves, as (x, lower, upper).
    Band { points: Vec<(f64, f64, f64)>, colour: RGBColor, opacity: f64 },
    /// A curve; `width` in figure units.
    Line { points: Vec<Point>, colour: RGBColor, width: f64 },
    /// A dashed curve.
    Dashes { points: Vec<Point>, colour: RGBColor },
    /// Separate dots; `radius` in figure units.
    Dots { points: Vec<Point>, colour: RGBColor, radius: f64 },
    /// A vertical stroke from zero to each point.
    Stems { points: Vec<Point>, colour: RGBColor, width: f64 },
    /// Bars standing on the horizontal axis, as (left, right, height).
    Bars { bars: Vec<(f64, f64, f64)>, colour: RGBColor },
    /// A word just under the upper edge, starting at `x`.
    Heading { x: f64, text: String, colour: RGBColor },
}

impl Mark {
    /// A series as one curve per part without gaps, thinned where it is long.
    pub(crate) fn curve(x: &[f64], y: &[f64], colour: RGBColor, width: f64) -> Vec<Self> {
        let parts = thin::parts(x, y, y);
        parts.iter().map(|part| Self::Line { points: thin::curve(part), colour, width }).collect()
    }

    /// A horizontal line over the width of `x`.
    pub(crate) fn level(x: (f64, f64), y: f64, colour: RGBColor) -> Self {
        Self::Line { points: vec![(x.0, y), (x.1, y)], colour, width: 1.2 }
    }

    /// A dashed horizontal line over the width of `x`.
    pub(crate) fn dashed_level(x: (f64, f64), y: f64, colour: RGBColor) -> Self {
        Self::Dashes { points: vec![(x.0, y), (x.1, y)], colour }
    }

    /// A horizontal band over the width of `x`.
    pub(crate) fn flat_band(x: (f64, f64), (lo, hi): (f64, f64), colour: RGBColor, opacity: f64) -> Self {
        Self::Band { points: vec![(x.0, lo, hi), (x.1, lo, hi)], colour, opacity }
    }
}
