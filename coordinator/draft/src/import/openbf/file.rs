//! An input file of openBF as it is written, read strictly: a key that is not known here is refused with its place.
//!
//! Next file to read: [`super::vessel`].

#![allow(clippy::struct_field_names, non_snake_case)] // the file's own keys

use serde::Deserialize;
use serde::de::IgnoredAny;

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub(super) project_name: String,
    pub(super) inlet_file: Option<String>,
    pub(super) blood: Blood,
    pub(super) solver: Solver,
    pub(super) network: Vec<Vessel>,
    // What it writes and where is the program's own business.
    #[serde(default, rename = "write_results")]
    _write_results: Option<IgnoredAny>,
    #[serde(default, rename = "output_directory")]
    _output_directory: Option<IgnoredAny>,
}

/// Blood.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Blood {
    /// Density in kg/m³.
    pub(super) rho: f64,
    /// Viscosity in Pa s.
    pub(super) mu: f64,
}

/// How the program runs; its steps are its own business.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Solver {
    /// Periods at most.
    pub(super) cycles: usize,
    /// Change of a mean pressure from one period to the next at which it ends, in mmHg.
    #[serde(default, alias = "convergence tolerance")]
    pub(super) convergence_tolerance: Option<f64>,
    /// Times of a period at which it gives results.
    pub(super) jump: Option<usize>,
    #[serde(default, rename = "Ccfl")]
    _courant: Option<IgnoredAny>,
}

/// A vessel.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Vessel {
    pub(super) label: String,
    /// Node at its start.
    pub(super) sn: i64,
    /// Node at its end.
    pub(super) tn: i64,
    /// Length in m.
    pub(super) L: f64,
    /// Young's modulus in Pa.
    pub(super) E: f64,
    /// Radius without load in m.
    pub(super) R0: Option<f64>,
    /// The same at the start of a vessel that tapers.
    pub(super) Rp: Option<f64>,
    /// The same at its end.
    pub(super) Rd: Option<f64>,
    /// Thickness of the wall in m; without it, it follows from the radius.
    pub(super) h0: Option<f64>,
    /// ζ of the velocity profile.
    pub(super) gamma_profile: Option<f64>,
    /// Pressure around it in Pa.
    #[serde(default)]
    pub(super) Pext: f64,
    /// Proximal resistance in Pa s/m³.
    pub(super) R1: Option<f64>,
    /// Distal resistance.
    pub(super) R2: Option<f64>,
    /// Compliance in m³/Pa.
    pub(super) Cc: Option<f64>,
    /// Pressure behind the distal resistance in Pa.
    #[serde(default)]
    pub(super) Pout: f64,
    /// Reflection coefficient.
    pub(super) Rt: Option<f64>,
    pub(super) outlet: Option<String>,
    #[serde(default)]
    pub(super) inlet_impedance_matching: bool,
    #[serde(default, rename = "visco-elastic")]
    pub(super) viscoelastic: bool,
    #[serde(default, rename = "gamma profile")]
    pub(super) old_gamma_profile: Option<IgnoredAny>,
    // Cells of its own grid, and whether results are kept.
    #[serde(default, rename = "M")]
    _cells: Option<IgnoredAny>,
    #[serde(default, rename = "to_save")]
    _to_save: Option<IgnoredAny>,
}

/// Reads the text of a file.
pub(super) fn read(text: &str) -> Result<File, String> {
    serde_saphyr::from_str(text).map_err(|error| {
        let message = error.without_snippet().to_string();
        let said =
            error.location().map(|at| with_place(text, (at.line() as usize, at.column() as usize), &message));
        old(text).or(said).unwrap_or(message)
    })
}

/// What is wrong at a place, with the place once and with what stands there.
fn with_place(text: &str, (line, column): (usize, usize), message: &str) -> String {
    let message = message.trim_end_matches(&format!(" at line {line}, column {column}"));
    let indent = |line: &str| line.chars().take_while(|c| c.is_whitespace()).any(|c| c == '\t');
    let speaks_of_tabs =
        message.split(|c: char| !c.is_alphabetic()).any(|word| ["tab", "tabs"].contains(&word));
    let is_here = |at: &usize| (at + 1).abs_diff(line) <= 1;
    if let Some(at) = text.lines().position(indent).filter(is_here).filter(|_| speaks_of_tabs) {
        return format!(
            "line {}: a tab stands before `{}`: YAML takes blanks alone there",
            at + 1,
            key(text, at + 1)
        );
    }
    format!("line {line}, column {column}: `{}`: {message}", key(text, line))
}

/// What stands in a line before its value, else all of the line.
fn key(text: &str, line: usize) -> &str {
    let whole = text.lines().nth(line.saturating_sub(1)).unwrap_or_default().trim();
    let entry = whole.trim_start_matches("- ");
    entry.split_once(':').map_or(whole, |(key, _)| key.trim())
}

/// Keys of openBF before its version 1.
const OLD: [&str; 7] =
    ["project name", "inlet", "inlet file", "inlet number", "R0p", "R0d", "convergence tollerance"];

/// What to do with a file of an older version of openBF.
fn old(text: &str) -> Option<String> {
    let key = |line: &str| {
        line.trim_start().trim_start_matches("- ").split(':').next().unwrap_or_default().trim().to_owned()
    };
    let (at, found) = text.lines().map(key).enumerate().find(|(_, key)| OLD.contains(&key.as_str()))?;
    Some(format!(
        "line {}: `{found}` is of an openBF before version 1: write `project_name`; `inlet_file` at the top, without `inlet`, `inlet file` and \
         `inlet number` of the vessel; `Rp` and `Rd` for `R0p` and `R0d`; `gamma_profile`; and `convergence_tolerance`, in mmHg",
        at + 1
    ))
}

/// The inflow: rows of a time in s and a flow in m³/s, separated by spaces, tabs or commas.
pub(super) fn inflow(text: &str) -> Result<(Vec<f64>, Vec<f64>), String> {
    let (mut times, mut flows) = (Vec::new(), Vec::new());
    for (i, line) in text.lines().enumerate() {
        let words: Vec<&str> =
            line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()).collect();
        let fault = || format!("line {}: `{}` is no time and a flow", i + 1, line.trim());
        match words[..] {
            [] => {}
            [time, flow] => {
                times.push(time.parse().map_err(|_| fault())?);
                flows.push(flow.parse().map_err(|_| fault())?);
            }
            _ => return Err(fault()),
        }
    }
    if times.len() < 2 {
        return Err(format!("{} rows: give a period of the inflow", times.len()));
    }
    Ok((times, flows))
}
