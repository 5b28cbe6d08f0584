//! The course of an output: median and bands of the ensemble, measured values, levels.

use starlings_estimators::forecast::Fan;
use starlings_study::forecast::Forecast;
use starlings_study::forecast::result::OutputForecast;

use crate::plot::axis::Axis;
use crate::plot::figure::{Figure, with_unit};
use crate::plot::mark::Mark;
use crate::plot::measured::{measured, measured_key};
use crate::plot::palette::{BLUE, Colour, GREEN, INK, LIMIT};
use crate::plot::scene::Scene;
use crate::plot::thin;

/// One figure per output.
pub(super) fn figures(found: &Forecast) -> Vec<Figure> {
    found.outputs.iter().map(|output| figure(found, output)).collect()
}

fn figure(found: &Forecast, output: &OutputForecast) -> Figure {
    let fan = &output.fan;
    let (time, value): (Vec<f64>, Vec<f64>) = output.observed.iter().copied().unzip();
    let levels: Vec<f64> =
        found.levels.iter().filter(|l| l.output == output.output).map(|l| l.value).collect();
    let all = fan.quantiles.iter().flatten().chain(&value).chain(&levels);
    let x = Axis::tight(&with_unit("time", &found.time_unit), fan.times.iter().copied());
    let y = Axis::around(&with_unit(&output.output, &output.unit), all.copied());
    let ends = (x.lo, x.hi);
    let mut marks = Vec::new();
    if let Some(wider) = &output.measured {
        marks.extend(band(wider, 0.05, 0.95, GREEN, 0.16));
    }
    marks.extend(band(fan, 0.05, 0.95, BLUE, 0.25));
    marks.extend(band(fan, 0.25, 0.75, BLUE, 0.45));
    marks.extend(row(fan, 0.5).into_iter().flat_map(|m| Mark::curve(&fan.times, m, BLUE, 1.75)));
    marks.extend(measured(&time, &value, INK));
    marks.extend(levels.iter().map(|level| Mark::dashed_level(ends, *level, LIMIT)));
    let caption =
        "Half of the members run within the darker band, nine in ten within the lighter one.".to_owned();
    let mut keys = vec![("line blue", "median"), ("area blue", "50 and 90\u{a0}% of the members")];
    if output.measured.is_some() {
        keys.push(("area green", "90\u{a0}% of what would be measured"));
    }
    if !time.is_empty() {
        keys.push((measured_key(&time), "measured"));
    }
    if !levels.is_empty() {
        keys.push(("dash limit", "level"));
    }
    let title = format!("{}: forecast", output.output);
    let scene = Scene { title, description: caption.clone(), x, y, marks };
    Figure::new(&scene, &keys, caption)
}

/// The quantiles of this probability.
fn row(fan: &Fan, p: f64) -> Option<&Vec<f64>> {
    let at = fan.probabilities.iter().position(|q| (q - p).abs() < 1e-9)?;
    fan.quantiles.get(at)
}

fn band(fan: &Fan, lo: f64, hi: f64, colour: Colour, opacity: f64) -> Vec<Mark> {
    let (Some(lo), Some(hi)) = (row(fan, lo), row(fan, hi)) else { return Vec::new() };
    let parts = thin::parts(&fan.times, lo, hi);
    parts.iter().map(|part| Mark::Band { points: thin::band(part), colour, opacity }).collect()
}
