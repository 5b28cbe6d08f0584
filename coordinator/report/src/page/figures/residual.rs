//! Residuals, observed − predicted, over time.

use super::fit::trained;
use super::{autocorrelation, field_map};
use crate::data::{ChannelPlot, ReportData};
use crate::page::outputs::{Output, examples, outputs};
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::measured::{measured, measured_key, spans};
use crate::plot::palette::{GREEN, INK, MUTED};
use crate::plot::scene::Scene;
use crate::{ReportError, number};

/// The residuals, each followed by its autocorrelation; of a field the map, and the autocorrelation at its middle.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn figures(data: &ReportData) -> Result<Vec<Figure>, ReportError> {
    let mut figures = Vec::new();
    for output in outputs(data) {
        match output {
            Output::Scalar(channel) => {
                figures.push(figure(channel, &data.time_unit)?);
                figures.extend(autocorrelation::figure(channel, data)?);
            }
            Output::Field(field, components) => {
                figures.push(field_map::figure(field, &components, &data.time_unit)?);
                figures.extend(autocorrelation::figure(examples(&components)[1], data)?);
            }
        }
    }
    Ok(figures)
}

/// Draws the residuals of one channel of one record.
fn figure(channel: &ChannelPlot, time_unit: &str) -> Result<Figure, ReportError> {
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
