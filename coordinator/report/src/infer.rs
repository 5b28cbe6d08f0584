//! The page and the files of a dynamical inference, made from its result alone.
//!
//! The verdict and the table come first, then how the estimate converged. Next files to read: [`figures`], and the template
//! `infer/infer.html`.

mod figures;
mod missing;

use std::path::Path;

use serde::Serialize;
use starlings_infer::Inference;
use starlings_infer::result::{CoefficientFound, ReducedFound};
use starlings_study::store::folder::write;

use super::plot::figure::Slots;
use super::{FilesError, ReportError, layout, number};
use missing::MissingTerms;

/// The page, ready to be arranged.
#[derive(Debug, Serialize)]
struct Page<'a> {
    found: &'a Inference,
    facts: Vec<(&'static str, String)>,
    coefficients: Vec<Row>,
    diffusion: Vec<Vec<String>>,
    unknowns: Vec<Row>,
    checks: Vec<[String; 4]>,
    missing: Option<MissingTerms>,
    figures: Slots,
}

/// A line of a table of coefficients.
#[derive(Debug, Default, Serialize)]
struct Row {
    name: String,
    estimate: String,
    sd: String,
    interval: String,
    says: String,
}

/// Makes the page: one HTML document that refers to nothing outside itself.
///
/// # Errors
///
/// [`ReportError`] when a figure or the page cannot be made.
pub fn infer_page(found: &Inference) -> Result<String, ReportError> {
    layout::document(include_str!("infer/infer.html"), Page::new(found)?)
}

/// Writes `infer.json`, `coefficients.csv` and `report.html` into a folder.
///
/// # Errors
/// When the page cannot be made or a file cannot be written.
pub fn write_inference(folder: &Path, found: &Inference) -> Result<(), FilesError> {
    let page = infer_page(found)?;
    let json = serde_json::to_string_pretty(found).map_err(ReportError::drawing)? + "\n";
    let files = [("infer.json", json), ("coefficients.csv", coefficients_csv(found)), ("report.html", page)];
    for (name, text) in files {
        let path = folder.join(name);
        write(&path, &text).map_err(|source| FilesError::Result { path, source })?;
    }
    Ok(())
}

/// The coefficients and the covariance of the noise as a table, a line each.
pub fn coefficients_csv(found: &Inference) -> String {
    let mut text = "name,estimate,sd,lo90,hi90,may_be_zero,observed\n".to_owned();
    let cell = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:?}"));
    for c in &found.coefficients {
        let [lo, hi] = c.interval90.map_or([None; 2], |ends| ends.map(Some));
        let zero = c.may_be_zero.map_or_else(String::new, |zero| zero.to_string());
        let cells = [cell(c.estimate), cell(c.sd), cell(lo), cell(hi), zero, c.observed.to_string()];
        text.push_str(&line(&c.name, &cells));
    }
    let (names, noise) = (&found.equations, &found.diffusion);
    for (i, row) in noise.matrix.iter().enumerate() {
        for (j, value) in row.iter().enumerate().skip(i) {
            let name = format!("D[{},{}]", names[i], names[j]);
            let [lo, hi] = noise.interval90[i].filter(|_| i == j).map_or([None; 2], |ends| ends.map(Some));
            let known = [String::new(), "true".to_owned()];
            let [value, sd] = [*value, noise.sd[i][j]].map(|v| cell(Some(v)));
            let cells = [value, sd, cell(lo), cell(hi)].into_iter().chain(known).collect::<Vec<_>>();
            text.push_str(&line(&name, &cells));
        }
    }
    text
}

fn line(name: &str, cells: &[String]) -> String {
    format!("{},{}\n", quoted(name), cells.join(","))
}

/// A name that may hold commas as a cell of a CSV file. Its white space, line breaks included, becomes single spaces.
fn quoted(name: &str) -> String {
    let name = name.split_whitespace().collect::<Vec<_>>().join(" ");
    if name.contains([',', '"']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name }
}

impl<'a> Page<'a> {
    fn new(found: &'a Inference) -> Result<Self, ReportError> {
        Ok(Self {
            found,
            facts: facts(found),
            coefficients: found.coefficients.iter().map(coefficient).collect(),
            diffusion: diffusion(found),
            unknowns: found.reduced.as_ref().map(unknowns).unwrap_or_default(),
            checks: checks(found),
            missing: found.missing.as_ref().map(MissingTerms::new),
            figures: figures::draw(found)?,
        })
    }
}

fn facts(found: &Inference) -> Vec<(&'static str, String)> {
    let step = format!("{} {}", number::significant(found.step, 4), found.time_unit);
    let mut facts = vec![
        ("Steps", found.n_step.to_string()),
        ("Sampling step", step),
        ("Recordings", found.records.len().to_string()),
        ("Equations", found.equations.join(", ")),
        ("Noise", found.diffusion.form.clone()),
    ];
    if let Some(richardson) = &found.richardson {
        facts.push(("Step's error", format!("taken out, of order {}", richardson.order)));
    }
    facts
}

fn coefficient(c: &CoefficientFound) -> Row {
    let sd = c.sd.unwrap_or(f64::NAN);
    let shown = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| number::with_sd(v, sd));
    let interval = c.interval90.map_or_else(
        || "–".to_owned(),
        |[lo, hi]| format!("{} to {}", number::with_sd(lo, sd), number::with_sd(hi, sd)),
    );
    let says = match (c.observed, c.may_be_zero) {
        (false, _) => "not observed",
        (true, Some(true)) => "may be zero",
        (true, _) => "",
    };
    Row {
        name: c.name.clone(),
        estimate: shown(c.estimate),
        sd: c.sd.map_or_else(|| "–".to_owned(), |sd| number::significant(sd, 2)),
        interval,
        says: says.to_owned(),
    }
}

fn diffusion(found: &Inference) -> Vec<Vec<String>> {
    let noise = &found.diffusion;
    let row = |i: usize| {
        let values = noise.matrix[i].iter().zip(&noise.sd[i]);
        let cells = values
            .map(|(value, sd)| format!("{} ± {}", number::with_sd(*value, *sd), number::significant(*sd, 2)));
        std::iter::once(found.equations[i].clone()).chain(cells).collect()
    };
    (0..noise.matrix.len()).map(row).collect()
}

fn unknowns(reduced: &ReducedFound) -> Vec<Row> {
    let row = |u: &starlings_infer::result::UnknownFound| Row {
        name: u.name.clone(),
        estimate: number::with_sd(u.estimate, u.sd),
        sd: number::significant(u.sd, 2),
        interval: format!(
            "{} to {}",
            number::with_sd(u.interval90[0], u.sd),
            number::with_sd(u.interval90[1], u.sd)
        ),
        says: String::new(),
    };
    reduced.unknowns.iter().map(row).collect()
}

fn checks(found: &Inference) -> Vec<[String; 4]> {
    let row = |check: &starlings_estimators::inference::NoiseCheck| {
        let verdict = match check.verdict {
            starlings_estimators::inference::Verdict::Matters => "errors of the measurement",
            starlings_estimators::inference::Verdict::Absent => "none that matter",
            starlings_estimators::inference::Verdict::Alike => "neighbours are alike",
            starlings_estimators::inference::Verdict::Unclear => "too few steps to say",
        };
        let ratio =
            format!("{} ± {}", number::with_sd(check.ratio, check.sd), number::significant(check.sd, 2));
        let measured = number::significant(check.measured.max(0.0).sqrt(), 2);
        [check.equation.clone(), ratio, measured, verdict.to_owned()]
    };
    found.noise_checks.iter().map(row).collect()
}

#[cfg(test)]
mod tests;
