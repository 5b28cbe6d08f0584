//! What can be drawn on two axes: plain data with all its points. What is drawn of a long series is the drawing's business.
//!
//! Next file to read: `drawing.rs`.

use super::palette::Colour;
use super::thin;

/// A point in the units of the axes.
pub(crate) type Point = (f64, f64);

/// One drawn thing; later marks lie on top of earlier ones. Values that are not finite are left out.
#[derive(Debug, Clone)]
pub(crate) enum Mark {
    /// A vertical region over the whole height.
    Span { from: f64, to: f64, colour: Colour },
    /// The region between two curves, as (x, lower, upper).
    Band { points: Vec<(f64, f64, f64)>, colour: Colour, opacity: f64 },
    /// A curve; `width` in pixels.
    Line { points: Vec<Point>, colour: Colour, width: f64 },
    /// A dashed curve.
    Dashes { points: Vec<Point>, colour: Colour },
    /// Separate dots; `radius` in pixels.
    Dots { points: Vec<Point>, colour: Colour, radius: f64 },
    /// A vertical stroke from zero to each point.
    Stems { points: Vec<Point>, colour: Colour, width: f64 },
    /// Bars standing on the horizontal axis, as (left, right, height).
    Bars { bars: Vec<(f64, f64, f64)>, colour: Colour },
    /// A word just under the upper edge, starting at `x`.
    Heading { x: f64, text: String, colour: Colour },
}

impl Mark {
    /// A series as one curve per part without gaps.
    pub(crate) fn curve(x: &[f64], y: &[f64], colour: Colour, width: f64) -> Vec<Self> {
        let parts = thin::parts(x, y, y);
        parts.iter().map(|part| Self::Line { points: thin::curve(part), colour, width }).collect()
    }

    /// A horizontal line over the width of `x`.
    pub(crate) fn level(x: (f64, f64), y: f64, colour: Colour) -> Self {
        Self::Line { points: vec![(x.0, y), (x.1, y)], colour, width: 1.2 }
    }

    /// A dashed horizontal line over the width of `x`.
    pub(crate) fn dashed_level(x: (f64, f64), y: f64, colour: Colour) -> Self {
        Self::Dashes { points: vec![(x.0, y), (x.1, y)], colour }
    }

    /// A horizontal band over the width of `x`.
    pub(crate) fn flat_band(x: (f64, f64), (lo, hi): (f64, f64), colour: Colour, opacity: f64) -> Self {
        Self::Band { points: vec![(x.0, lo, hi), (x.1, lo, hi)], colour, opacity }
    }

    /// Its colour.
    pub(crate) fn colour(&self) -> Colour {
        match self {
            Self::Span { colour, .. }
            | Self::Band { colour, .. }
            | Self::Line { colour, .. }
            | Self::Dashes { colour, .. }
            | Self::Dots { colour, .. }
            | Self::Stems { colour, .. }
            | Self::Bars { colour, .. }
            | Self::Heading { colour, .. } => *colour,
        }
    }

    /// The shape by which a legend shows it; a heading has none.
    pub(crate) fn shape(&self) -> Option<&'static str> {
        match self {
            Self::Span { .. } | Self::Band { .. } | Self::Bars { .. } => Some("area"),
            Self::Line { .. } | Self::Stems { .. } => Some("line"),
            Self::Dashes { .. } => Some("dash"),
            Self::Dots { .. } => Some("dot"),
            Self::Heading { .. } => None,
        }
    }
}
