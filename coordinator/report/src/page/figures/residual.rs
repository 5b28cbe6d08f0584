//! Residuals, observed − predicted, over time: below every fit, and what they have in common.
//!
//! Next file to read: [`super::autocorrelation`].

use super::fit::trained;
use super::{autocorrelation, field_map};
use crate::data::{ChannelPlot, ReportData};
use crate::number;
use crate::page::outputs::{Output, examples, outputs};
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::measured::{drawn_as_dots, measured};
use crate::plot::palette::{BLUE, GREEN, MUTED, PURPLE, SHADE};
use crate::plot::scene::Scene;

/// Figures at most.
const MOST: usize = 24;

/// The autocorrelations, and of a field the map.
pub(super) fn figures(data: &ReportData) -> Vec<Figure> {
    let of = |output: Output<'_>| match output {
        Output::Scalar(channel) => autocorrelation::figure(channel, data).into_iter().collect::<Vec<_>>(),
        Output::Field(field, components) => {
            let map = field_map::figure(field, &components, &data.time_unit);
            let at_middle = autocorrelation::figure(examples(&components)[1], data);
            std::iter::once(map).chain(at_middle).collect()
        }
    };
    let outputs = outputs(data);
    // Of a field or a channel there are more figures than one, or none: what is told are the outputs that are not drawn.
    let mut drawn: Vec<Figure> = Vec::new();
    let mut left_out = 0;
    for output in outputs {
        if drawn.len() < MOST { drawn.extend(of(output)) } else { left_out += 1 }
    }
    drawn.truncate(MOST);
    if let Some(last) = drawn.pop() {
        let more = format!("Residuals of {left_out} outputs and records more are in run.db.");
        drawn.push(if left_out > 0 { last.saying(&more) } else { last });
    }
    drawn
}

/// The residuals of one channel of one record, in the colour of the span that they belong to.
pub(super) fn scene(channel: &ChannelPlot, x: &Axis) -> Scene {
    let residual = residuals(channel);
    let margin = if channel.noise.is_finite() { 2.0 * channel.noise } else { 0.0 };
    let y = Axis::around(
        &with_unit("observed − predicted", &channel.unit),
        residual.iter().copied().chain([-margin, margin]),
    );
    let ends = (x.lo, x.hi);
    let mut marks = Vec::new();
    let span = trained(channel);
    marks.extend(span.map(|[from, to]| Mark::Span { from: from.max(x.lo), to: to.min(x.hi), colour: SHADE }));
    marks.push(Mark::flat_band(ends, (-margin, margin), GREEN, 0.16));
    marks.push(Mark::level(ends, 0.0, MUTED));
    let dots = drawn_as_dots(&channel.time);
    let inside = |t: f64| span.is_some_and(|[from, to]| t >= from && t <= to);
    for (fitted, colour) in [(true, BLUE), (false, PURPLE)] {
        let of: Vec<f64> = channel
            .time
            .iter()
            .zip(&residual)
            .map(|(t, r)| if inside(*t) == fitted { *r } else { f64::NAN })
            .collect();
        if of.iter().any(|r| r.is_finite()) {
            let drawn = measured(&channel.time, &of, colour);
            marks.extend(if dots { drawn } else { drawn.into_iter().map(thin_line).collect() });
        }
    }
    let title = format!("{}, record {}: residuals", channel.channel, channel.record);
    Scene { title, description: share(channel), x: x.clone(), y, marks }
}

fn thin_line(mark: Mark) -> Mark {
    match mark {
        Mark::Line { points, colour, .. } => Mark::Line { points, colour, width: 1.0 },
        other => other,
    }
}

/// How many of the residuals noise explains, as a sentence.
pub(super) fn share(channel: &ChannelPlot) -> String {
    let residual = residuals(channel);
    let known = residual.iter().filter(|r| r.is_finite()).count();
    let inside = residual.iter().filter(|r| r.abs() <= 2.0 * channel.noise).count();
    if known == 0 {
        return "Nothing was measured here.".to_owned();
    }
    format!(
        "{} of {known} residuals lie within ± 2 noise sd (95\u{a0}% are expected). A pattern that repeats is an effect that the model lacks.",
        number::percent(inside as f64 / known as f64)
    )
}

fn residuals(channel: &ChannelPlot) -> Vec<f64> {
    channel.observed.iter().zip(&channel.predicted).map(|(o, p)| o.unwrap_or(f64::NAN) - p).collect()
}
