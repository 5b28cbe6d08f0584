//! Predicted against measured, over time.

use plotters::style::RGBColor;

use super::super::data::ChannelPlot;
use super::super::{ReportError, number};
use super::axis::Axis;
use super::figure::{Figure, with_unit};
use super::mark::Mark;
use super::palette::{BLUE, INK, MUTED, SHADE, VERMILION};
use super::scene::Scene;
use super::thin;

/// At most this many measured values are drawn as dots.
const DOTS: usize = 160;

/// Draws one channel of one record.
///
/// # Errors
///
/// The figure cannot be drawn.
pub(crate) fn figure(channel: &ChannelPlot, time_unit: &str) -> Result<Figure, ReportError> {
    let mut keys = vec![(measured_key(&channel.time), "measured")];
    if trained(channel).is_some() {
        keys.extend([("line blue", "predicted, training"), ("area shade", "training span")]);
    }
    if trained(channel).is_none_or(|[_, to]| channel.time.iter().any(|t| *t > to)) {
        keys.push(("line vermilion", "predicted, held out"));
    }
    let band = if trained(channel).is_some() { "area blue" } else { "area vermilion" };
    keys.push((band, "prediction ± 2 noise sd"));
    Figure::new(&scene(channel, time_unit), &keys, caption(channel))
}

/// The scene of one channel of one record.
pub(crate) fn scene(channel: &ChannelPlot, time_unit: &str) -> Scene {
    let observed: Vec<f64> = channel.observed.iter().map(|v| v.unwrap_or(f64::NAN)).collect();
    let margin = 2.0 * finite_or_zero(channel.noise);
    let reach = channel.predicted.iter().flat_map(|p| [p - margin, p + margin]);
    let y = Axis::around(&with_unit(&channel.channel, &channel.unit), reach.chain(observed.iter().copied()))
        .with_headroom();
    let x = Axis::tight(&with_unit("time", time_unit), channel.time.iter().copied());
    let mut marks = spans(trained(channel), &x);
    marks.extend(prediction(channel, margin, 0.16));
    marks.extend(measured(&channel.time, &observed, INK));
    marks.extend(prediction(channel, margin, 0.0));
    Scene {
        title: format!("{}, record {}: predicted against measured", channel.channel, channel.record),
        description: caption(channel),
        x,
        y,
        marks,
    }
}

/// The training span and the words above both spans.
pub(crate) fn spans(trained: Option<[f64; 2]>, x: &Axis) -> Vec<Mark> {
    let Some([from, to]) = trained else {
        return vec![Mark::Heading { x: x.lo, text: "held out".to_owned(), colour: VERMILION }];
    };
    let (from, to) = (from.clamp(x.lo, x.hi), to.clamp(x.lo, x.hi));
    let mut marks = vec![Mark::Span { from, to, colour: SHADE }];
    let room = |width: f64| width > 0.22 * (x.hi - x.lo);
    if room(to - from) {
        marks.push(Mark::Heading { x: from, text: "training".to_owned(), colour: MUTED });
    }
    if room(x.hi - to) {
        marks.push(Mark::Heading { x: to, text: "held out".to_owned(), colour: VERMILION });
    }
    marks
}

/// Measured values: dots when they are few, otherwise a curve.
pub(crate) fn measured(time: &[f64], value: &[f64], colour: RGBColor) -> Vec<Mark> {
    let known: Vec<_> = time.iter().copied().zip(value.iter().copied()).filter(|p| p.1.is_finite()).collect();
    if drawn_as_dots(time) {
        return vec![Mark::Dots { points: known, colour, radius: 2.25 }];
    }
    thin::parts(time, value, value)
        .iter()
        .map(|part| match thin::curve(part) {
            points if points.len() < 2 => Mark::Dots { points, colour, radius: 1.75 },
            points => Mark::Line { points, colour, width: 1.25 },
        })
        .collect()
}

/// Whether [`measured`] draws a series at these times as dots.
pub(crate) fn drawn_as_dots(time: &[f64]) -> bool {
    time.len() <= DOTS
}

/// The legend's sample for what [`measured`] draws in ink.
pub(crate) fn measured_key(time: &[f64]) -> &'static str {
    if drawn_as_dots(time) { "dot ink" } else { "line ink" }
}

/// The training span of a channel that was fitted.
pub(crate) fn trained(channel: &ChannelPlot) -> Option<[f64; 2]> {
    channel.train.filter(|_| !channel.held_out_channel)
}

/// The prediction's band (`opacity` > 0) or its curve, in the colour of each span.
fn prediction(channel: &ChannelPlot, margin: f64, opacity: f64) -> Vec<Mark> {
    let (time, value) = (&channel.time, &channel.predicted);
    let n = time.len().min(value.len());
    let span = trained(channel);
    let first = span.map_or(0, |[from, _]| time[..n].partition_point(|t| *t < from));
    let last = span.map_or(0, |[_, to]| time[..n].partition_point(|t| *t <= to));
    let mut marks = Vec::new();
    // Each piece begins where the one before ends, so that the curve has no hole.
    let pieces =
        [(0, (first + 1).min(n), VERMILION), (first, last, BLUE), (last.saturating_sub(1), n, VERMILION)];
    let skip_head = first == 0;
    for (k, (from, to, colour)) in pieces.into_iter().enumerate() {
        if from >= to || (k == 0 && skip_head) || (k == 2 && last == n) {
            continue;
        }
        for part in thin::parts(&time[from..to], &value[from..to], &value[from..to]) {
            marks.push(if opacity > 0.0 {
                Mark::Band { points: thin::band(&part, margin), colour, opacity }
            } else {
                Mark::Line { points: thin::curve(&part), colour, width: 2.0 }
            });
        }
    }
    marks
}

fn caption(channel: &ChannelPlot) -> String {
    let with_unit = |value: f64| number::quantity(value, &channel.unit);
    let mut numbers = Vec::new();
    numbers.extend(channel.train_rmse.map(|v| format!("training RMSE {}", with_unit(v))));
    numbers.extend(channel.held_out_rmse.map(|v| format!("held-out RMSE {}", with_unit(v))));
    numbers.push(format!("noise sd {}", with_unit(channel.noise)));
    let never = if channel.held_out_channel { " This channel was never fitted." } else { "" };
    format!(
        "{}.{never} A prediction that explains the data leaves about 5\u{a0}% of the measured values outside the band.",
        sentence(&numbers.join(", "))
    )
}

/// The text with a capital first letter.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn finite_or_zero(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}
