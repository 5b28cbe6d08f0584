//! Predicted against measured, over time.

use crate::data::{ChannelPlot, ReportData};
use crate::page::outputs::{Output, examples, outputs};
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::measured::{measured, measured_key, spans};
use crate::plot::palette::{BLUE, INK, VERMILION};
use crate::plot::scene::Scene;
use crate::plot::thin;
use crate::{ReportError, number};

/// One figure per scalar output; of a field the first, the middle and the last component.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn figures(data: &ReportData) -> Result<Vec<Figure>, ReportError> {
    let shown = outputs(data).into_iter().flat_map(|output| match output {
        Output::Scalar(channel) => vec![channel],
        Output::Field(_, components) => examples(&components).to_vec(),
    });
    shown.map(|channel| figure(channel, &data.time_unit)).collect()
}

fn figure(channel: &ChannelPlot, time_unit: &str) -> Result<Figure, ReportError> {
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
