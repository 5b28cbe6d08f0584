//! The curves of an identifiability analysis: sensitivities, generalised sensitivities, collinearity.

use plotters::style::RGBColor;
use starlings_study::identify::Identification;

use crate::ReportError;
use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREEN, GREY, INK, MUTED, VERMILION};
use crate::plot::scene::Scene;

/// Colours of the records, and their names in a caption.
const RECORDS: [(RGBColor, &str); 4] =
    [(BLUE, "blue"), (VERMILION, "vermilion"), (GREEN, "green"), (INK, "black")];
/// Collinearity index that Brun, Reichert & Künsch (2001) call critical.
const CRITICAL: f64 = 10.0;

/// One figure per parameter: how strongly the predictions of each time answer to it.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn sensitivity(found: &Identification) -> Result<Vec<Figure>, ReportError> {
    let series = &found.sensitivity;
    let largest = |curve: &[f64]| curve.iter().copied().fold(0.0, f64::max);
    let figure = |(name, curve): (&String, &Vec<f64>)| {
        let x = Axis::tight(&with_unit("time", &found.time_unit), series.time.iter().copied());
        let y = Axis::around("change of the predictions [noise sd per prior sd]", [0.0, largest(curve)]);
        let mut marks = vec![Mark::level((x.lo, x.hi), 0.0, MUTED)];
        for (k, record) in found.records.iter().enumerate() {
            let span = record.first..(record.first + record.n).min(curve.len());
            let colour = RECORDS[k % RECORDS.len()].0;
            marks.extend(Mark::curve(&series.time[span.clone()], &curve[span], colour, 1.75));
        }
        let caption = format!(
            "At most {} noise sd for one prior sd.{} Where the curve is at zero, a datum says nothing of {name}.",
            number::significant(largest(curve), 2),
            record_names(found)
        );
        let title = format!("{name}: sensitivity");
        let scene = Scene { title, description: caption.clone(), x, y, marks };
        let key = if found.records.len() < 2 { "sensitivity" } else { "first record" };
        Figure::new(&scene, &[("line blue", key)], caption)
    };
    series.curves.iter().filter_map(|(name, curve)| Some((name, curve.as_ref()?))).map(figure).collect()
}

fn record_names(found: &Identification) -> String {
    if found.records.len() < 2 {
        return String::new();
    }
    let named = |(k, record): (usize, &starlings_study::identify::result::RecordSteps)| {
        format!("{}: {}", RECORDS[k % RECORDS.len()].1, record.record)
    };
    format!(" {}.", found.records.iter().enumerate().map(named).collect::<Vec<_>>().join(", "))
}

/// One figure per parameter with a generalised sensitivity function, the others behind it.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn generalised(found: &Identification) -> Result<Vec<Figure>, ReportError> {
    let series = &found.gsf;
    // Times of several records overlap: then the observation times are counted.
    let one = found.records.len() < 2;
    let x_values: Vec<f64> =
        if one { series.time.clone() } else { (1..=series.time.len()).map(|k| k as f64).collect() };
    let x_label = if one {
        with_unit("time", &found.time_unit)
    } else {
        "observation time, counted through the records".to_owned()
    };
    let known: Vec<(&String, &Vec<f64>)> =
        series.curves.iter().filter_map(|(name, curve)| Some((name, curve.as_ref()?))).collect();
    let figure = |(name, curve): &(&String, &Vec<f64>)| {
        let x = Axis::tight(&x_label, x_values.iter().copied());
        let y = Axis::around("generalised sensitivity", curve.iter().copied().chain([0.0, 1.0]));
        let ends = (x.lo, x.hi);
        let mut marks = vec![Mark::level(ends, 0.0, MUTED), Mark::dashed_level(ends, 1.0, MUTED)];
        for (_, other) in known.iter().filter(|(other, _)| other != name) {
            marks.extend(Mark::curve(&x_values, other, GREY, 1.0));
        }
        marks.extend(Mark::curve(&x_values, curve, BLUE, 2.0));
        let half = curve.iter().position(|v| *v >= 0.5).map(|k| x_values[k]);
        let caption = format!(
            "{}The data bear on {name} where the curve rises; where it falls, they bear on parameters that are \
             correlated with it.",
            half.map_or_else(String::new, |t| format!(
                "Half of it is reached at {}. ",
                number::significant(t, 3)
            ))
        );
        let title = format!("{name}: generalised sensitivity");
        let scene = Scene { title, description: caption.clone(), x, y, marks };
        Figure::new(&scene, &[("line blue", "this parameter"), ("line grey", "the others")], caption)
    };
    known.iter().map(figure).collect()
}

/// The index of the best conditioned subset of every size.
///
/// # Errors
///
/// The figure cannot be drawn.
pub(super) fn collinearity(found: &Identification) -> Result<Option<Figure>, ReportError> {
    let points: Vec<(f64, f64)> = found
        .collinearity
        .growing
        .iter()
        .filter_map(|subset| Some((subset.parameters.len() as f64, subset.index?)))
        .collect();
    if points.is_empty() {
        return Ok(None);
    }
    let x = Axis::over_run("parameters in the subset", points.iter().map(|p| p.0));
    let y = Axis::log_around("collinearity index", points.iter().map(|p| p.1).chain([1.0, CRITICAL]));
    let marks = vec![
        Mark::dashed_level((x.lo, x.hi), CRITICAL, MUTED),
        Mark::Line { points: points.clone(), colour: BLUE, width: 1.75 },
        Mark::Dots { points: points.clone(), colour: BLUE, radius: 3.0 },
    ];
    let below = points.iter().filter(|p| p.1 < CRITICAL).map(|p| p.0).fold(1.0, f64::max);
    let caption = format!(
        "Up to {below:.0} of these parameters can be estimated together with an index below {CRITICAL}: from there on, a \
         change of one is hidden by changes of the others to within a tenth."
    );
    let title = "Collinearity of growing subsets".to_owned();
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    let keys = [("dot blue", "best conditioned subset"), ("dash muted", "critical")];
    Figure::new(&scene, &keys, caption).map(Some)
}
