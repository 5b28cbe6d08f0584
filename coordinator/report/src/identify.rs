//! The page of an identifiability analysis: one HTML document, made from its result alone.
//!
//! Warnings and advice come before numbers, as in the report of a run. Next files to read: [`figures`], and the template
//! `identify.html`.

mod figures;

use serde::Serialize;
use starlings_study::identify::Identification;
use starlings_study::identify::result::{ParameterInfo, SubsetInfo};

use super::data::ParameterRow;
use super::hangs_on::{self, HangsOnView};
use super::plot::figure::Slots;
use super::plot::interval;
use super::{ReportError, correlation, layout, number};

/// At most this many subsets are listed.
const SUBSETS: usize = 12;

/// The page, ready to be arranged.
#[derive(Debug, Serialize)]
struct Page<'a> {
    found: &'a Identification,
    facts: Vec<(&'static str, String)>,
    parameters: Vec<ParameterView>,
    directions: Vec<[String; 3]>,
    correlation: Vec<Vec<correlation::Cell>>,
    /// Names of the parameters in the table of correlations.
    correlated: Vec<&'a str>,
    correlation_left_out: usize,
    figures: Slots,
    subsets: Vec<[String; 2]>,
    subsets_left_out: usize,
    hangs_on: Option<HangsOnView>,
}

#[derive(Debug, Serialize)]
struct ParameterView {
    name: String,
    unit: String,
    value: String,
    expected: String,
    prior: String,
    left: String,
    bits: String,
    strip: String,
}

/// Makes the page: one HTML document that refers to nothing outside itself.
///
/// # Errors
///
/// [`ReportError`] when a figure or the page cannot be made.
pub fn identify_page(found: &Identification) -> Result<String, ReportError> {
    layout::document(include_str!("identify.html"), Page::new(found)?)
}

impl<'a> Page<'a> {
    fn new(found: &'a Identification) -> Result<Self, ReportError> {
        let subsets = &found.collinearity.subsets;
        Ok(Self {
            found,
            facts: facts(found),
            parameters: found.parameters.iter().map(parameter).collect(),
            directions: directions(found),
            correlation: found
                .correlation
                .iter()
                .take(correlation::MOST)
                .enumerate()
                .map(|(k, row)| cells(k, &row[..row.len().min(correlation::MOST)]))
                .collect(),
            correlated: found.parameters.iter().take(correlation::MOST).map(|p| p.name.as_str()).collect(),
            correlation_left_out: found.parameters.len().saturating_sub(correlation::MOST),
            figures: figures::draw(found)?,
            subsets: subsets.iter().take(SUBSETS).map(subset).collect(),
            subsets_left_out: subsets.len().saturating_sub(SUBSETS),
            hangs_on: hangs_on::view(Some(&found.hangs_on)),
        })
    }
}

fn facts(found: &Identification) -> Vec<(&'static str, String)> {
    vec![
        ("Model", found.model.clone()),
        ("Taken at", found.at.clone()),
        ("Observed values", found.n_obs.to_string()),
        ("Model runs", found.runs.to_string()),
        ("Collinearity index", index(found.collinearity.index)),
    ]
}

fn parameter(p: &ParameterInfo) -> ParameterView {
    let row = ParameterRow {
        name: p.name.clone(),
        unit: p.unit.clone(),
        estimate: p.value,
        sd: p.expected_sd_physical,
        lo: p.expected_interval95[0],
        hi: p.expected_interval95[1],
        other: None,
        prior_median: p.prior_median,
        prior_lo: p.prior_interval95[0],
        prior_hi: p.prior_interval95[1],
    };
    ParameterView {
        name: p.name.clone(),
        unit: p.unit.clone(),
        value: number::with_sd(p.value, p.expected_sd_physical),
        expected: number::significant(p.expected_sd_physical, 2),
        prior: number::significant(p.prior_sd_physical, 2),
        left: format!("{} %", number::significant(100.0 * p.expected_sd / p.prior_sd, 2)),
        bits: number::with_sd(p.information_bits, 0.1),
        strip: interval::strip(&row, p.transform.starts_with("log") && p.transform != "logit"),
    }
}

fn directions(found: &Identification) -> Vec<[String; 3]> {
    let row = |d: &starlings_study::identify::result::DirectionInfo| {
        let alone = d.standard_error.map_or_else(
            || "no information".to_owned(),
            |sd| format!("{} {}", number::significant(sd, 2), d.unit),
        );
        let left = format!("{} %", number::significant(100.0 * d.share, 2));
        [d.combination.clone(), left, alone]
    };
    found.directions.iter().map(row).collect()
}

fn cells(diagonal: usize, row: &[Option<f64>]) -> Vec<correlation::Cell> {
    let known = |value: &Option<f64>| value.unwrap_or(f64::NAN);
    correlation::row(diagonal, &row.iter().map(known).collect::<Vec<_>>())
}

fn subset(subset: &SubsetInfo) -> [String; 2] {
    [subset.parameters.join(", "), index(subset.index)]
}

fn index(index: Option<f64>) -> String {
    index.map_or_else(|| "dependent".to_owned(), |v| number::significant(v, 3))
}
