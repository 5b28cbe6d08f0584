//! The residuals of a field as a map: component against time.
//!
//! A cell is the mean residual over a span of time and a few neighbouring components, so that noise averages out and what the
//! model lacks stays.

use crate::data::ChannelPlot;
use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{ABOVE, BELOW, Colour};
use crate::plot::scene::Scene;

/// Cells along the time axis at most.
const COLUMNS: usize = 60;
/// Rows of cells at most.
const ROWS: usize = 32;
/// Shades of either colour; cells of the same shade in a row are drawn as one.
const SHADES: i32 = 6;

/// Draws the components of one field in one record, given with their indices.
pub(super) fn figure(field: &str, components: &[(usize, &ChannelPlot)], time_unit: &str) -> Figure {
    let times = components.iter().flat_map(|(_, c)| c.time.iter().copied());
    let x = Axis::tight(&with_unit("time", time_unit), times);
    let y = Axis::counted(&format!("component of {field}"), components.iter().map(|(i, _)| *i as f64));
    let cells = Cells::new(components, (x.lo, x.hi));
    let scale = cells.largest().max(1.0);
    let marks = cells.marks(scale);
    let record = components.first().map_or("", |(_, c)| c.record.as_str());
    let caption = format!(
        "Mean of (observed − predicted)/noise in each cell; the fullest colour is ± {}. White noise leaves cells almost \
         empty; stripes along time or along the components are an effect that the model lacks.",
        number::significant(scale, 2)
    );
    let title = format!("{field}, record {record}: residuals by component");
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let keys = [("area above", "observed above predicted"), ("area below", "observed below predicted")];
    Figure::map(&scene, &keys, caption)
}

/// Mean whitened residuals by cell.
struct Cells {
    /// Lower and upper component of every row.
    rows: Vec<(f64, f64)>,
    /// Edges of the columns.
    edges: Vec<f64>,
    /// Mean of every cell, row by row; NaN without data.
    mean: Vec<f64>,
}

impl Cells {
    fn new(components: &[(usize, &ChannelPlot)], (from, to): (f64, f64)) -> Self {
        let longest = components.iter().map(|(_, c)| c.time.len()).max().unwrap_or(0);
        let n = longest.clamp(1, COLUMNS);
        let edges: Vec<f64> = (0..=n).map(|k| from + (to - from) * k as f64 / n as f64).collect();
        let per_row = components.len().div_ceil(ROWS).max(1);
        let (mut rows, mut mean) = (Vec::new(), Vec::new());
        for group in components.chunks(per_row) {
            let (Some(first), Some(last)) = (group.first(), group.last()) else { continue };
            rows.push((first.0 as f64 - 0.5, last.0 as f64 + 0.5));
            let mut sums = vec![(0.0, 0_u32); n];
            for (_, channel) in group {
                add(channel, (from, to), &mut sums);
            }
            mean.extend(sums.into_iter().map(|(sum, count)| sum / f64::from(count)));
        }
        Self { rows, edges, mean }
    }

    fn largest(&self) -> f64 {
        self.mean.iter().filter(|v| v.is_finite()).fold(0.0, |max: f64, v| max.max(v.abs()))
    }

    /// One band per run of equal shades; the palest shade is not drawn.
    fn marks(&self, scale: f64) -> Vec<Mark> {
        let n = self.edges.len() - 1;
        let mut marks = Vec::new();
        for (row, (lo, hi)) in self.rows.iter().enumerate() {
            let shades: Vec<i32> =
                self.mean[row * n..(row + 1) * n].iter().map(|v| shade(*v, scale)).collect();
            let mut at = 0;
            for run in shades.chunk_by(|a, b| a == b) {
                let (left, right) = (self.edges[at], self.edges[at + run.len()]);
                at += run.len();
                if run[0] != 0 {
                    let (colour, opacity) = colour(run[0]);
                    let points = vec![(left, *lo, *hi), (right, *lo, *hi)];
                    marks.push(Mark::Band { points, colour, opacity });
                }
            }
        }
        marks
    }
}

fn add(channel: &ChannelPlot, (from, to): (f64, f64), sums: &mut [(f64, u32)]) {
    let n = sums.len();
    let values = channel.observed.iter().zip(&channel.predicted).zip(&channel.time);
    for ((observed, predicted), time) in values {
        let residual = observed.map_or(f64::NAN, |o| (o - predicted) / channel.noise);
        if residual.is_finite() {
            let at = ((time - from) / (to - from) * n as f64).clamp(0.0, n as f64 - 1.0) as usize;
            sums[at].0 += residual;
            sums[at].1 += 1;
        }
    }
}

fn shade(value: f64, scale: f64) -> i32 {
    if value.is_finite() { (value / scale * f64::from(SHADES)).round() as i32 } else { 0 }
}

fn colour(shade: i32) -> (Colour, f64) {
    let opacity = f64::from(shade.abs()) / f64::from(SHADES);
    (if shade > 0 { ABOVE } else { BELOW }, 0.9 * opacity)
}
