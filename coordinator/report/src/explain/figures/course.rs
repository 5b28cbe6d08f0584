//! Measured against simulated without and with the added effects, and the residuals of both.
//!
//! The effect is judged by the held-out span and channels, which no fit has seen. Next file to read: `region.rs`.

use starlings_explain::result::{Explanation, GapRow};
use starlings_explain::{Curve, Figures};
use starlings_study::field::component_of;

use crate::explain::gap::{rows, words};
use crate::number::quantity;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::measured::{measured, measured_key, spans};
use crate::plot::palette::{BLUE, GREEN, INK, MUTED, VERMILION};
use crate::plot::scene::Scene;

/// Curves drawn at most.
const CURVES: usize = 24;
/// Observed components up to which every one of a field is drawn by itself.
const FEW: usize = 3;

/// Of every curve that is drawn the values and the residuals.
pub(super) fn figures(found: &Explanation, data: &Figures) -> Vec<Figure> {
    let rows = rows(found, data);
    let mut figures = Vec::new();
    for curve in shown(&data.curves).into_iter().take(CURVES) {
        let (upper, mut keys) = values(curve, &data.time_unit, &numbers(curve, &rows));
        let below = residuals(curve, &data.time_unit);
        keys.push(("area green", "± 2 noise sd"));
        let caption = format!("{} {}", upper.description, below.description);
        figures.push(Figure::with_below(&upper, &below, &keys, caption));
    }
    figures
}

/// How many curves are not drawn.
pub(in crate::explain) fn left_out(data: &Figures) -> usize {
    data.curves.len().saturating_sub(shown(&data.curves).len().min(CURVES))
}

/// The curves that are drawn: of a field its first, middle and last component.
fn shown(curves: &[Curve]) -> Vec<&Curve> {
    let field = |c: &Curve| component_of(&c.channel).map(|(field, _)| field.to_owned());
    let groups = curves.chunk_by(|a, b| a.record == b.record && field(a).is_some() && field(a) == field(b));
    let pick = |group: &'_ [Curve]| -> Vec<usize> {
        let n = group.len();
        if n > FEW { vec![0, n / 2, n - 1] } else { (0..n).collect() }
    };
    groups.flat_map(|group| pick(group).into_iter().map(move |k| &group[k])).collect()
}

/// What a legend says: a sample, and its meaning.
type Entries = Vec<(&'static str, &'static str)>;

/// One channel of one record with its legend; `numbers` is the sentence with its errors.
fn values(curve: &Curve, time_unit: &str, numbers: &str) -> (Scene, Entries) {
    let series = [&curve.observed, &curve.before, &curve.after];
    let label = with_unit(&curve.channel, &curve.unit);
    let y = Axis::around(&label, series.into_iter().flatten().copied()).with_headroom();
    let x = time_axis(curve, time_unit);
    let mut marks = background(curve, &x);
    marks.extend(measured(&curve.time, &curve.observed, INK));
    marks.extend(Mark::curve(&curve.time, &curve.before, VERMILION, 1.75));
    marks.extend(Mark::curve(&curve.time, &curve.after, BLUE, 2.0));
    let mut keys =
        vec![(measured_key(&curve.time), "measured"), ("line dot vermilion", "before: the model as it is")];
    if !curve.after.is_empty() {
        keys.push(("line dot blue", "after: with the effect"));
    }
    keys.extend(shade_key(curve));
    let see = if curve.after.is_empty() {
        "The gap is what lies between the measured values and the curve."
    } else {
        "An effect that belongs there brings the blue curve to the measured values beyond the shade as well."
    };
    let title = format!("{}, record {}: measured and simulated", curve.channel, curve.record);
    let caption = format!("{numbers} {see}");
    (Scene { title, description: caption, x, y, marks }, keys)
}

/// The residuals of one channel of one record.
fn residuals(curve: &Curve, time_unit: &str) -> Scene {
    let of =
        |simulated: &[f64]| curve.observed.iter().zip(simulated).map(|(o, s)| o - s).collect::<Vec<f64>>();
    let (before, after) = (of(&curve.before), of(&curve.after));
    let margin = if curve.noise.is_finite() { 2.0 * curve.noise.abs() } else { 0.0 };
    let label = with_unit("observed − predicted", &curve.unit);
    let reach = before.iter().chain(&after).copied().chain([-margin, margin]);
    let y = Axis::around(&label, reach).with_headroom();
    let x = time_axis(curve, time_unit);
    let ends = (x.lo, x.hi);
    let is_span = |mark: &Mark| matches!(mark, Mark::Span { .. });
    let mut marks: Vec<Mark> = background(curve, &x).into_iter().filter(is_span).collect();
    marks.push(Mark::flat_band(ends, (-margin, margin), GREEN, 0.16));
    marks.push(Mark::level(ends, 0.0, MUTED));
    marks.extend(measured(&curve.time, &before, VERMILION));
    marks.extend(measured(&curve.time, &after, BLUE));
    let caption = if after.is_empty() {
        "What stays outside the band is the gap; a pattern that repeats is an effect that the model lacks."
            .to_owned()
    } else {
        "Where blue lies in the band and vermilion does not, the effect closes the gap; what blue still shows outside is left."
            .to_owned()
    };
    let title = format!("{}, record {}: residuals", curve.channel, curve.record);
    Scene { title, description: caption, x, y, marks }
}

/// The errors of one curve, as a sentence.
fn numbers(curve: &Curve, rows: &[GapRow]) -> String {
    let own = rows.iter().filter(|row| row.channel == curve.channel && row.record == curve.record);
    let mut parts: Vec<String> = own
        .map(|row| {
            let before = quantity(row.before, &curve.unit);
            if row.after.is_finite() {
                format!(
                    "{} RMSE {before} before, {} after",
                    words(&row.usage),
                    quantity(row.after, &curve.unit)
                )
            } else {
                format!("{} RMSE {before}", words(&row.usage))
            }
        })
        .collect();
    parts.push(format!("noise sd {}", quantity(curve.noise, &curve.unit)));
    let mut letters = parts.join("; ");
    if let Some(first) = letters.get(..1).map(str::to_uppercase) {
        letters.replace_range(..1, &first);
    }
    format!("{letters}.")
}

fn time_axis(curve: &Curve, time_unit: &str) -> Axis {
    Axis::tight(&with_unit("time", time_unit), curve.time.iter().copied())
}

fn trained(curve: &Curve) -> Option<[f64; 2]> {
    curve.train.filter(|span| !curve.held_out && span.iter().all(|end| end.is_finite()))
}

/// The spans, their words in the colour of secondary text.
fn background(curve: &Curve, x: &Axis) -> Vec<Mark> {
    let plain = |mark| match mark {
        Mark::Heading { x, text, .. } => Mark::Heading { x, text, colour: MUTED },
        other => other,
    };
    spans(trained(curve), x).into_iter().map(plain).collect()
}

fn shade_key(curve: &Curve) -> Option<(&'static str, &'static str)> {
    trained(curve).map(|_| ("area shade", "training span"))
}
