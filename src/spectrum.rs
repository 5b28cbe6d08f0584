//! `starlings spectrum`: the poles of a study's model under every observer that it can host, and which gain to choose.
//!
//! Next file to read: [`mod@print`].

mod print;

use std::path::{Path, PathBuf};

use clap::Parser;
use starlings_coordinator::report::locus::{Locus, render};
use starlings_coordinator::study::{Study, posterior};
use starlings_models::nearest;
use starlings_models::observer::kinds;
use starlings_models::spectrum::{Decay, Laboratory, ObserverSpectrum};

use crate::console::line;
use crate::csv_file::{self, Place};
use crate::failure::Failure;

/// Poles in the result where no number is asked for.
const LISTED: usize = 100;

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
    json: bool,
}

/// What was found.
struct Found<'a> {
    study: &'a Study,
    laboratory: Laboratory,
    decay: Option<Decay>,
    /// Poles listed, at most those that there are.
    listed: usize,
    /// Poles in the table for people.
    rows: usize,
    observers: Vec<ObserverSpectrum>,
    refused: Vec<(String, String)>,
}

/// `FACTOR/TIME`.
fn decay(text: &str) -> Result<Decay, String> {
    let (factor, time) = text.split_once('/').ok_or("expected FACTOR/TIME, such as 10/0.1")?;
    let read = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("`{text}` is not a number"));
    Decay::new(read(factor)?, read(time)?).map_err(|error| error.to_string())
}

/// Examines the observers and writes what was asked for.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    check(args)?;
    let study = Study::load(&args.study)?;
    csv_file::check_outputs(
        &[("--csv", &args.csv), ("--html", &args.html)],
        &study.text,
        &Place::Known(&study.file),
    )?;
    let found = examine(args, &study)?;
    if let Some(path) = &args.csv {
        write_csv(path, &found)?;
    }
    if let Some(path) = &args.html {
        write_page(path, &found)?;
    }
    if args.json { line(format_args!("{:#}", print::as_json(&found))) } else { print::text(&found) }
}

/// Refuses names and numbers that are wrong whatever the study is.
fn check(args: &Args) -> Result<(), Failure> {
    let known: Vec<&str> = kinds().iter().map(|kind| kind.kind).collect();
    if let Some(name) = args.observers.iter().find(|name| !known.contains(&name.as_str())) {
        let hint = nearest(name, &known).map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
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

fn examine<'a>(args: &Args, study: &'a Study) -> Result<Found<'a>, Failure> {
    let medians = study.theta_for(0, posterior::prior(study).mean.as_slice());
    let laboratory = Laboratory::new(&study.setup, &medians).map_err(Failure::input)?;
    let listed = args.poles.unwrap_or(LISTED).min(laboratory.poles().len());
    let given =
        |own: &[f64], otherwise: &[f64]| if own.is_empty() { otherwise.to_vec() } else { own.to_vec() };
    let mut gains = given(&args.gains, &study.spectrum.gains);
    if gains.is_empty() {
        gains = laboratory.usual_gains(2 * print::ROWS);
    }
    let wanted = if args.observers.is_empty() { &study.spectrum.observers } else { &args.observers };
    let (mut kinds, mut refused) = (Vec::new(), Vec::new());
    for (kind, why) in laboratory.observers() {
        match why {
            None => kinds.push(kind.to_owned()),
            Some(why) => refused.push((kind.to_owned(), why.to_string())),
        }
    }
    if !wanted.is_empty() {
        // An observer that was asked for and cannot be is an error; of the others nobody wants to know why.
        refused.clear();
        kinds.clear();
        for kind in wanted {
            if !kinds.contains(kind) {
                kinds.push(kind.clone());
            }
        }
    }
    let decay = args.decay.or(study.spectrum.decay);
    let work = |kind: &String| laboratory.examine(kind, &gains, listed, decay);
    let results: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = kinds.iter().map(|kind| scope.spawn(move || work(kind))).collect();
        threads.into_iter().map(std::thread::ScopedJoinHandle::join).collect()
    });
    let mut observers = Vec::with_capacity(results.len());
    for result in results {
        let result = result.map_err(|_| Failure::run("an observer could not be examined"))?;
        observers.push(result.map_err(Failure::input)?);
    }
    let rows = args.poles.unwrap_or(print::ROWS);
    Ok(Found { study, laboratory, decay, listed, rows, observers, refused })
}

/// The listed poles at every gain, one row each.
fn write_csv(path: &Path, found: &Found<'_>) -> Result<(), Failure> {
    let heading = ["observer", "gain", "max_re", "pole", "re", "im"].map(str::to_owned);
    let mut rows = vec![heading];
    for observer in &found.observers {
        let mut gains = observer.gain.clone();
        gains.push(0.0);
        gains.sort_by(f64::total_cmp);
        gains.dedup();
        let ways = observer.locus(&gains, found.listed).map_err(Failure::run)?;
        for (gain, max_re) in observer.gain.iter().zip(&observer.max_re) {
            let at = gains.iter().position(|g| g.to_bits() == gain.to_bits()).unwrap_or(0);
            for (pole, way) in ways.iter().enumerate() {
                let [gain, max_re, re, im] =
                    [*gain, *max_re, way[at].re, way[at].im].map(|v| format!("{v:?}"));
                rows.push([observer.name.clone(), gain, max_re, pole.to_string(), re, im]);
            }
        }
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
        poles: found.laboratory.poles(),
        listed: found.listed,
        decay: found.decay,
        observers: &found.observers,
        refused: &found.refused,
    });
    std::fs::write(path, page.map_err(Failure::run)?)
        .map_err(|error| Failure::input(format!("cannot write {}: {error}", path.display())))
}
