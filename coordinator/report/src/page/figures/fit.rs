//! Predicted against measured, over time.

use super::residual;
use crate::data::{ChannelPlot, ReportData};
use crate::number;
use crate::page::outputs::{Output, examples, outputs};
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::measured::{measured, measured_key, spans};
use crate::plot::palette::{BLUE, INK, PURPLE};
use crate::plot::scene::Scene;
use crate::plot::thin;

/// Figures at most.
const MOST: usize = 24;

/// One figure per scalar output, its residuals below it; of a field the first, the middle and the last component. Records of one
/// output share the vertical axis.
pub(super) fn figures(data: &ReportData) -> Vec<Figure> {
    let shown = shown(data);
    let channels = shown.iter().take(MOST);
    channels.map(|channel| figure(channel, alike(channel, &shown), &data.time_unit)).collect()
}

/// How many are not drawn.
pub(in crate::page) fn left_out(data: &ReportData) -> usize {
    shown(data).len().saturating_sub(MOST)
}

fn shown(data: &ReportData) -> Vec<&ChannelPlot> {
    let mut list = Vec::new();
    for output in outputs(data) {
        match output {
            Output::Scalar(channel) => list.push(channel),
            Output::Field(_, components) => list.extend(examples(&components)),
        }
    }
    list
}

/// The range of values of the same output in every record.
fn alike(channel: &ChannelPlot, shown: &[&ChannelPlot]) -> Vec<f64> {
    let same = shown.iter().filter(|other| other.channel == channel.channel && other.unit == channel.unit);
    let ends = same.flat_map(|other| {
        let [_, outer] = margins(other);
        let reach = other.predicted.iter().zip(outer).flat_map(|(p, margin)| [p - margin, p + margin]);
        let all = reach.chain(other.observed.iter().copied().flatten()).filter(|v| v.is_finite());
        let (lo, hi) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        [lo, hi]
    });
    ends.collect()
}

fn figure(channel: &ChannelPlot, reach: Vec<f64>, time_unit: &str) -> Figure {
    let mut keys = vec![(measured_key(&channel.time), "measured")];
    if trained(channel).is_some() {
        keys.extend([("line dot blue", "fitted"), ("area shade", "training span")]);
    }
    if trained(channel).is_none_or(|[_, to]| channel.time.iter().any(|t| *t > to)) {
        keys.push(("line dot purple", "held out"));
    }
    let band = if trained(channel).is_some() { "area blue purple" } else { "area purple" };
    if has_spread(channel) {
        keys.push((band, "prediction ± 2 sd of parameters (dark), and of parameters and noise"));
    } else {
        keys.push((band, "prediction ± 2 noise sd"));
    }
    keys.push(("area green", "± 2 noise sd"));
    let upper = scene_within(channel, reach, time_unit);
    let below = residual::scene(channel, &upper.x);
    Figure::with_below(&upper, &below, &keys, format!("{} {}", caption(channel), residual::share(channel)))
}

/// The scene of one channel of one record.
pub(crate) fn scene(channel: &ChannelPlot, time_unit: &str) -> Scene {
    scene_within(channel, alike(channel, &[channel]), time_unit)
}

/// The same on a vertical axis that holds `reach`.
fn scene_within(channel: &ChannelPlot, reach: Vec<f64>, time_unit: &str) -> Scene {
    let observed: Vec<f64> = channel.observed.iter().map(|v| v.unwrap_or(f64::NAN)).collect();
    let [inner, outer] = margins(channel);
    let y = Axis::around(&with_unit(&channel.channel, &channel.unit), reach).with_headroom();
    let x = Axis::tight(&with_unit("time", time_unit), channel.time.iter().copied());
    let mut marks = spans(trained(channel), &x);
    marks.extend(prediction(channel, &outer, 0.16));
    if has_spread(channel) {
        marks.extend(prediction(channel, &inner, 0.28));
    }
    marks.extend(measured(&channel.time, &observed, INK));
    marks.extend(prediction(channel, &vec![0.0; channel.predicted.len()], 0.0));
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

/// Whether anything is known of what the uncertainty of the parameters makes of the prediction.
fn has_spread(channel: &ChannelPlot) -> bool {
    channel.spread.iter().any(Option::is_some)
}

/// Half widths of the bands: of the parameters' uncertainty, and of noise with it, two standard deviations each.
fn margins(channel: &ChannelPlot) -> [Vec<f64>; 2] {
    let noise = finite_or_zero(channel.noise);
    let spread = |k: usize| channel.spread.get(k).copied().flatten().map_or(0.0, finite_or_zero);
    let of = |noise: f64| (0..channel.predicted.len()).map(|k| 2.0 * noise.hypot(spread(k))).collect();
    [of(0.0), of(noise)]
}

/// The prediction's band (`opacity` > 0) or its curve, in the colour of each span.
fn prediction(channel: &ChannelPlot, margin: &[f64], opacity: f64) -> Vec<Mark> {
    let (time, value) = (&channel.time, &channel.predicted);
    let n = time.len().min(value.len());
    let edge = |side: f64| value.iter().zip(margin).map(|(v, m)| m.mul_add(side, *v)).collect::<Vec<f64>>();
    let (lo, hi) = (edge(-1.0), edge(1.0));
    let span = trained(channel);
    let first = span.map_or(0, |[from, _]| time[..n].partition_point(|t| *t < from));
    let last = span.map_or(0, |[_, to]| time[..n].partition_point(|t| *t <= to));
    let mut marks = Vec::new();
    // Each piece begins where the one before ends, so that the curve has no hole.
    let pieces = [(0, (first + 1).min(n), PURPLE), (first, last, BLUE), (last.saturating_sub(1), n, PURPLE)];
    let skip_head = first == 0;
    for (k, (from, to, colour)) in pieces.into_iter().enumerate() {
        if from >= to || (k == 0 && skip_head) || (k == 2 && last == n) {
            continue;
        }
        for part in thin::parts(&time[from..to], &lo[from..to], &hi[from..to]) {
            marks.push(if opacity > 0.0 {
                Mark::Band { points: thin::band(&part), colour, opacity }
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
    let (it, holds) = if has_spread(channel) {
        (
            "the wide one",
            "The wide band holds the noise as stated and, to first order, the uncertainty of the parameters; the dark one that uncertainty alone.",
        )
    } else {
        (
            "it",
            "The band holds the noise as stated, not the uncertainty of the parameters, which is not known here.",
        )
    };
    format!(
        "{}.{never} {holds} A prediction that explains the data leaves about 5\u{a0}% of the measured values outside {it}.",
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
