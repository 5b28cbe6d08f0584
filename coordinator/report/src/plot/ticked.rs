//! An axis as the drawing library wants it: its scale, and its ticks instead of the library's own.
//!
//! Our own because plotters lets a caller choose the text of a tick but not its value. Where the ticks stand is not decided here. Next file to read: `axis.rs`.

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;

use super::axis::{Axis, Tick};

/// An axis' own scale with its ticks, for the drawing library.
pub(super) struct Ticked {
    scale: RangedCoordf64,
    ticks: Vec<Tick>,
}

impl Ticked {
    pub(super) fn new(axis: &Axis, ticks: Vec<Tick>) -> Self {
        let (lo, hi) = axis.ends();
        Self { scale: (lo..hi).into(), ticks }
    }
}

impl Ranged for Ticked {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.scale.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            Vec::new()
        } else {
            self.ticks.iter().map(|t| t.at).collect()
        }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.scale.range()
    }
}

impl ValueFormatter<f64> for Ticked {
    fn format_ext(&self, value: &f64) -> String {
        let nearest = self.ticks.iter().min_by(|a, b| (a.at - value).abs().total_cmp(&(b.at - value).abs()));
        nearest.map_or(String::new(), |tick| tick.text.clone())
    }
}
