//! The page of a forecast: one HTML document, made from its result alone.
//!
//! Levels and when they are crossed come first, then the courses. Next files to read: [`figures`], and the template
//! `forecast/forecast.html`.

mod figures;

use serde::Serialize;
use starlings_study::forecast::Forecast;
use starlings_study::forecast::measurement::{Errors, From};
use starlings_study::forecast::result::{LevelForecast, OutputForecast};

use super::plot::figure::Slots;
use super::{ReportError, layout, number};

/// The page, ready to be arranged.
#[derive(Debug, Serialize)]
struct Page<'a> {
    found: &'a Forecast,
    headline: String,
    facts: Vec<(&'static str, String)>,
    levels: Vec<[String; 5]>,
    outputs: Vec<[String; 7]>,
    figures: Slots,
}

/// Makes the page: one HTML document that refers to nothing outside itself.
///
/// # Errors
///
/// [`ReportError`] when a figure or the page cannot be made.
pub fn forecast_page(found: &Forecast) -> Result<String, ReportError> {
    let page = Page {
        found,
        headline: headline(found),
        facts: facts(found),
        levels: found.levels.iter().map(|level| level_row(level, &found.time_unit)).collect(),
        outputs: found.outputs.iter().map(output_row).collect(),
        figures: figures::draw(found)?,
    };
    layout::document(include_str!("forecast/forecast.html"), page)
}

fn headline(found: &Forecast) -> String {
    let says: Vec<&str> = found.levels.iter().map(|level| level.says.as_str()).collect();
    if says.is_empty() { format!("Forecast up to {}.", found.until) } else { says.join(". ") + "." }
}

fn facts(found: &Forecast) -> Vec<(&'static str, String)> {
    let noise = if found.model_noise { "drawn" } else { "none" };
    vec![
        ("Model", found.model.clone()),
        ("Record", found.record.clone()),
        ("Members", found.members.to_string()),
        ("Until", number::quantity(found.until, &found.time_unit)),
        ("Noise of the states", noise.to_owned()),
    ]
}

fn level_row(level: &LevelForecast, time_unit: &str) -> [String; 5] {
    let what = level.says.split(':').next().unwrap_or_default().to_owned();
    let none = || "none".to_owned();
    let interval = level
        .interval90
        .map(|[lo, hi]| format!("{} to {}", number::significant(lo, 4), number::quantity(hi, time_unit)));
    let horizon = level.horizon.zip(level.probability_by_horizon);
    [
        what,
        number::significant(level.probability, 3),
        horizon.map_or_else(none, |(t, p)| format!("{} by {t}", number::significant(p, 3))),
        level.median.map_or_else(none, |t| number::quantity(t, time_unit)),
        interval.unwrap_or_else(none),
    ]
}

fn output_row(output: &OutputForecast) -> [String; 7] {
    let [median, lo, hi] = output.at_end.map(|v| number::significant(v, 4));
    let share = |of: Option<f64>| of.map_or_else(String::new, number::percent);
    let coverage = output.coverage90.map(|c| [share(c.train), share(c.held_out)]).unwrap_or_default();
    let [train, held_out] = coverage;
    let measured = output.measured_at_end.map(|band| band.map(|v| number::significant(v, 4)));
    [
        output.output.clone(),
        format!("{median} {}", output.unit),
        format!("{lo} to {hi}"),
        measured.map_or_else(String::new, |[lo, hi]| format!("{lo} to {hi}")),
        output.errors.map_or_else(String::new, |errors| errors_of(&errors, &output.unit)),
        train,
        held_out,
    ]
}

/// The size of the errors of measured values, and where it comes from.
fn errors_of(errors: &Errors, unit: &str) -> String {
    let from = match errors.from {
        From::Noise => "stated noise",
        From::Residuals => "its training residuals",
        From::OtherResiduals => "as residuals of fitted outputs exceed their noise",
        From::OwnValues => "its own measured values, never fitted",
        From::Inferred => "of the inference",
    };
    format!("{} ({from})", number::quantity(errors.sd, unit))
}

#[cfg(test)]
mod tests;
