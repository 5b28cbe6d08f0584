//! `starlings spectrum`: the poles of a study's model under every observer that it can host, and which gain to choose.
//!
//! Next file to read: [`mod@print`]; what is found is found in `coordinator/study/src/spectrum.rs`.

mod print;

use std::path::{Path, PathBuf};

use clap::Parser;
use starlings_coordinator::report::locus::{Locus, render};
use starlings_coordinator::study::Study;
use starlings_coordinator::study::spectrum::{ExamineError, Spectrum, Wanted, examine, observer_names};
use starlings_models::spectrum::Decay;
use starlings_models::{meant, nearest};

use crate::console::line;
use crate::csv_file::{self, StudyLocation};
use crate::failure::Failure;
use crate::load::load_for_poles;

/// Show how the poles of the study's model move with the gain of each observer.
///
/// The model stands at its prior medians, where its runs start, with the channels of the study observed. What the options
/// leave open is taken from the study's section `[spectrum]`.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// Observers to compare, such as sdf,dvf; without it all that the model can host.
    #[arg(long, value_name = "KIND,...", value_delimiter = ',')]
    observers: Vec<String>,
    /// Gains in 1/time, such as 0,50,100; without it a range around the poles.
    #[arg(long, value_name = "GAIN,...", value_delimiter = ',', allow_negative_numbers = true)]
    gains: Vec<f64>,
    /// The decay that is wanted, such as 10/0.1: every error ten times smaller within 0.1.
    #[arg(long, value_name = "FACTOR/TIME", value_parser = decay, allow_hyphen_values = true)]
    decay: Option<Decay>,
    /// How many of the slowest poles (smallest modulus) are listed; 100 without it, fewer on a terminal.
    #[arg(long, value_name = "N")]
    poles: Option<usize>,
    /// Write the listed poles at every gain as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write a page with the root locus.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// What was found, and how much of it people are shown.
struct Found<'a> {
    study: &'a Study,
    spectrum: Spectrum,
    /// Poles in the table for people.
    rows: usize,
}

/// `FACTOR/TIME`.
fn decay(text: &str) -> Result<Decay, String> {
    let (factor, time) = text.split_once('/').ok_or("expected FACTOR/TIME, such as 10/0.1")?;
    let read = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("`{text}` is not a number"));
    Decay::new(read(factor)?, read(time)?).map_err(|error| error.to_string())
}

/// Examines the observers and writes what was asked for.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let study = load_for_poles(&args.study)?;
    check(args, &observer_names(&study.setup.observer))?;
    csv_file::check_outputs(
        &[("--csv", &args.csv), ("--html", &args.html)],
        &study.text,
        &StudyLocation::Known(&study.file),
    )?;
    let wanted = Wanted {
        observers: args.observers.clone(),
        gains: args.gains.clone(),
        decay: args.decay,
        poles: args.poles,
    };
    let spectrum = examine(&study, &wanted).map_err(|error| match error {
        ExamineError::Spectrum(_) | ExamineError::Solver => Failure::input(error),
        ExamineError::Broken(_) => Failure::run(error),
    })?;
    let found = Found { study: &study, spectrum, rows: args.poles.unwrap_or(print::ROWS) };
    if let Some(path) = &args.csv {
        write_csv(path, &found)?;
    }
    if let Some(path) = &args.html {
        write_page(path, &found)?;
    }
    if args.json { line(format_args!("{:#}", print::as_json(&found))) } else { print::text(&found) }
}

/// Refuses names that are none of the study's, and numbers that are wrong.
fn check(args: &Args, known: &[String]) -> Result<(), Failure> {
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    if let Some(name) = args.observers.iter().find(|name| !known.contains(&name.as_str())) {
        let hint = meant(nearest(name, &known));
        let known = known.join(", ");
        return Err(Failure::input(format!(
            "--observers: no observer named `{name}`{hint} (known: {known})"
        )));
    }
    match args.gains.iter().find(|gain| !(gain.is_finite() && **gain >= 0.0)) {
        Some(gain) => Err(Failure::input(format!(
            "--gains: {gain} is no gain: give finite numbers, zero or above (0 shows the model without observer)"
        ))),
        None => Ok(()),
    }
}

/// The listed poles at every gain, one row each.
fn write_csv(path: &Path, found: &Found<'_>) -> Result<(), Failure> {
    let mut rows = vec![["observer", "gain", "max_re", "pole", "re", "im"].map(str::to_owned)];
    for point in found.spectrum.locus().map_err(Failure::run)? {
        let [gain, max_re, re, im] = [point.gain, point.max_re, point.re, point.im].map(|v| format!("{v:?}"));
        rows.push([point.observer, gain, max_re, point.pole.to_string(), re, im]);
    }
    csv_file::write(Some(path), rows)
}

fn write_page(path: &Path, found: &Found<'_>) -> Result<(), Failure> {
    let page = render(&Locus {
        study: &found.study.name,
        says: &found.study.says,
        model: &found.study.setup.model.kind,
        time_unit: &found.study.time_unit,
        outputs: &found.study.setup.outputs,
        poles: found.spectrum.linearised.poles(),
        listed: found.spectrum.listed,
        decay: found.spectrum.decay,
        observers: &found.spectrum.observers,
        refused: &found.spectrum.refused,
    });
    std::fs::write(path, page.map_err(Failure::run)?)
        .map_err(|error| Failure::input(format!("cannot write {}: {error}", path.display())))
}
