//! Residuals, observed − predicted, over time.

use super::super::data::ChannelPlot;
use super::super::{ReportError, number};
use super::axis::Axis;
use super::figure::{Figure, with_unit};
use super::fit::{measured, measured_key, spans, trained};
use super::mark::Mark;
use super::palette::{GREEN, INK, MUTED};
use super::scene::Scene;

/// Draws the residuals of one channel of one record.
///
/// # Errors
///
/// The figure cannot be drawn.
pub(crate) fn figure(channel: &ChannelPlot, time_unit: &str) -> Result<Figure, ReportError> {
    let residual: Vec<f64> =
        channel.observed.iter().zip(&channel.predicted).map(|(o, p)| o.unwrap_or(f64::NAN) - p).collect();
    let margin = if channel.noise.is_finite() { 2.0 * channel.noise } else { 0.0 };
    let x = Axis::tight(&with_unit("time", time_unit), channel.time.iter().copied());
    let label = with_unit(&format!("{}, observed − predicted", channel.channel), &channel.unit);
    let y = Axis::around(&label, residual.iter().copied().chain([-margin, margin])).with_headroom();
    let ends = (x.lo, x.hi);
    let mut marks = spans(trained(channel), &x);
    marks.push(Mark::flat_band(ends, (-margin, margin), GREEN, 0.16));
    marks.push(Mark::level(ends, 0.0, MUTED));
    marks.extend(measured(&channel.time, &residual, INK));
    let known = residual.iter().filter(|r| r.is_finite()).count();
    let inside = residual.iter().filter(|r| r.abs() <= margin).count();
    let caption = format!(
        "{} of {known} residuals lie within ± 2 noise sd (95\u{a0}% are expected). A pattern that repeats is an effect that the model lacks.",
        number::percent(inside as f64 / known as f64)
    );
    let title = format!("{}, record {}: residuals", channel.channel, channel.record);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Figure::new(&scene, &[(measured_key(&channel.time), "residual"), ("area green", "± 2 noise sd")], caption)
}
