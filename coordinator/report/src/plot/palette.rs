//! Colours, safe for colour-blind readers, and the sizes of text and figures.
//!
//! Okabe & Ito, "Color universal design" (2008). The page turns the neutral colours round on a dark screen by their exact
//! values (see `report.css`), so a colour here and there must stay equal.

use plotters::style::RGBColor;

/// Text and measured values.
pub(crate) const INK: RGBColor = RGBColor(0x1F, 0x29, 0x33);
/// Axes, tick labels and secondary text.
pub(crate) const MUTED: RGBColor = RGBColor(0x5B, 0x66, 0x70);
/// Grid lines.
pub(crate) const GRID: RGBColor = RGBColor(0xE4, 0xE8, 0xEB);
/// The training span.
pub(crate) const SHADE: RGBColor = RGBColor(0xF0, 0xF3, 0xF5);
/// Prior, earlier passes.
pub(crate) const GREY: RGBColor = RGBColor(0x9A, 0xA5, 0xAE);
/// Prediction and posterior.
pub(crate) const BLUE: RGBColor = RGBColor(0x00, 0x72, 0xB2);
/// Held-out span.
pub(crate) const VERMILION: RGBColor = RGBColor(0xD5, 0x5E, 0x00);
/// Bands of what is expected.
pub(crate) const GREEN: RGBColor = RGBColor(0x00, 0x9E, 0x73);

/// Drawing units per figure unit: the drawing library places everything on whole numbers, which would show as steps.
pub(crate) const SUBUNITS: i32 = 4;
/// Width of a figure, in figure units: on a 390 px wide screen one unit is about 0.73 px.
pub(crate) const FIGURE_WIDTH: i32 = 480;
/// Height of a figure, in figure units.
pub(crate) const FIGURE_HEIGHT: i32 = 270;
/// Size of text, in figure units.
pub(crate) const TEXT: i32 = 15;
