//! The page and the files of a diagnosis, made from its result alone.
//!
//! The verdict and the library come first, then the courses. Next files to read: [`figures`], and the template
//! `diagnose/diagnose.html`.

mod figures;

use std::path::Path;

use serde::Serialize;
use starlings_diagnose::Diagnosed;
use starlings_diagnose::result::{Departure, ParameterFound, ScenarioFound};
use starlings_models::units::spaced;
use starlings_study::store::folder::write;

use super::plot::figure::Slots;
use super::{FilesError, ReportError, layout, number};

/// The page, ready to be arranged.
#[derive(Debug, Serialize)]
struct Page<'a> {
    found: &'a Diagnosed,
    facts: Vec<(&'static str, String)>,
    scenarios: Vec<[String; 6]>,
    parameters: Vec<[String; 5]>,
    tests: Vec<[String; 4]>,
    figures: Slots,
}

/// Makes the page: one HTML document that refers to nothing outside itself.
///
/// # Errors
///
/// [`ReportError`] when a figure or the page cannot be made.
pub fn diagnosis_page(found: &Diagnosed) -> Result<String, ReportError> {
    let page = Page {
        found,
        facts: facts(found),
        scenarios: found.scenarios.iter().map(scenario).collect(),
        parameters: found.scenarios.iter().flat_map(parameters).collect(),
        tests: tests(found),
        figures: figures::draw(found)?,
    };
    layout::document(include_str!("diagnose/diagnose.html"), page)
}

/// Writes `diagnose.json`, `scenarios.csv` and `report.html` into a folder.
///
/// # Errors
/// When the page cannot be made or a file cannot be written.
pub fn write_diagnosis(folder: &Path, found: &Diagnosed) -> Result<(), FilesError> {
    let page = diagnosis_page(found)?;
    let json = serde_json::to_string_pretty(found).map_err(ReportError::drawing)? + "\n";
    let files = [("diagnose.json", json), ("scenarios.csv", scenarios_csv(found)), ("report.html", page)];
    for (name, text) in files {
        let path = folder.join(name);
        write(&path, &text).map_err(|source| FilesError::Result { path, source })?;
    }
    Ok(())
}

/// A line for every parameter of every scenario.
fn scenarios_csv(found: &Diagnosed) -> String {
    let mut text = "scenario,probability,misfit,explains,parameter,estimate,sd,lo90,hi90\n".to_owned();
    for s in &found.scenarios {
        let misfit = s.misfit.map_or_else(String::new, |v| format!("{v:?}"));
        let name = s.name.replace('"', "\"\"");
        for p in &s.parameters {
            let [lo, hi] = p.interval90;
            let of = (s.probability, misfit.as_str(), s.explains);
            let line = format!(
                "\"{name}\",{:?},{},{},{},{:?},{:?},{lo:?},{hi:?}\n",
                of.0, of.1, of.2, p.name, p.estimate, p.sd
            );
            text.push_str(&line);
        }
    }
    text
}

fn facts(found: &Diagnosed) -> Vec<(&'static str, String)> {
    vec![
        ("Model", found.model.clone()),
        ("Measured values", found.n_value.to_string()),
        ("Scenarios", found.scenarios.len().to_string()),
        ("Model runs", found.runs.to_string()),
        ("False alarms", number::percent(found.alarm.rate)),
    ]
}

fn scenario(s: &ScenarioFound) -> [String; 6] {
    let severity = s.severity().map_or_else(String::new, shown);
    let misfit = s.misfit.map_or_else(|| number::ABSENT.to_owned(), |v| number::significant(v, 3));
    let factor = s.log_bayes_factor.map_or_else(|| number::ABSENT.to_owned(), |v| number::significant(v, 3));
    let left = match (&s.failure, s.explains) {
        (Some(reason), _) => format!("not run: {reason}"),
        (None, true) => "noise".to_owned(),
        (None, false) => "more than noise".to_owned(),
    };
    [s.name.clone(), format!("{:.3}", s.probability), factor, severity, misfit, left]
}

/// An estimate with its interval.
fn shown(p: &ParameterFound) -> String {
    let [lo, hi] = p.interval90.map(|v| number::with_sd(v, p.sd));
    let unit = spaced(&p.unit);
    format!("{}{unit} ({lo} to {hi})", number::with_sd(p.estimate, p.sd))
}

fn parameters(s: &ScenarioFound) -> Vec<[String; 5]> {
    let row = |p: &ParameterFound| {
        let sd = number::significant(p.sd, 2);
        let before = number::significant(p.prior_median, 3);
        [s.name.clone(), p.name.clone(), shown(p), sd, before]
    };
    s.parameters.iter().map(row).collect()
}

/// The tests of the model without a fault: what, where, χ², by chance.
fn tests(found: &Diagnosed) -> Vec<[String; 4]> {
    let departure = |what: &str, d: &Departure| {
        let place = format!(
            "{} of {}, {} to {}",
            d.output,
            d.record,
            number::significant(d.since, 5),
            number::quantity(d.until, &found.time_unit)
        );
        let chi = format!("{} for {}", number::significant(d.chi_squared, 4), d.degrees);
        [what.to_owned(), place, chi, chance(d.by_chance)]
    };
    let mut tests = Vec::new();
    tests.extend(found.alarm.seen.as_ref().map(|d| departure("first departure", d)));
    tests.extend(found.alarm.strongest.as_ref().map(|d| departure("largest departure", d)));
    tests.extend(found.alarm.matched.as_ref().map(|m| {
        let chi = format!("{} for {}", number::significant(m.chi_squared, 4), m.degrees);
        ["fit of a scenario".to_owned(), m.scenario.clone(), chi, chance(m.by_chance)]
    }));
    tests
}

fn chance(p: f64) -> String {
    match p {
        p if p <= 0.0 => "below 1e-300".to_owned(),
        p if p < 1e-3 => format!("{p:.0e}"),
        p => format!("{p:.3}"),
    }
}
