//! How strongly the predictions of each time answer to each parameter.

use plotters::style::RGBColor;
use starlings_study::identify::Identification;
use starlings_study::identify::result::RecordSteps;

use crate::ReportError;
use crate::number;
use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::palette::{BLUE, GREEN, INK, MUTED, VERMILION};
use crate::plot::scene::Scene;

/// Colours of the records, and their names in a caption.
const RECORDS: [(RGBColor, &str); 4] =
    [(BLUE, "blue"), (VERMILION, "vermilion"), (GREEN, "green"), (INK, "black")];

/// One figure per parameter: how strongly the predictions of each time answer to it.
///
/// # Errors
///
/// A figure cannot be drawn.
pub(super) fn figures(found: &Identification) -> Result<Vec<Figure>, ReportError> {
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
    let named =
        |(k, record): (usize, &RecordSteps)| format!("{}: {}", RECORDS[k % RECORDS.len()].1, record.record);
    format!(" {}.", found.records.iter().enumerate().map(named).collect::<Vec<_>>().join(", "))
}
