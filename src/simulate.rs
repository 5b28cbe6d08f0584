//! `starlings simulate`: a twin experiment, data whose truth is known.

use std::path::PathBuf;

use clap::Parser;
use starlings_coordinator::study::Study;
use starlings_coordinator::study::twin::{Recording, Twin, simulate};

use crate::failure::Failure;

/// Run the study's model forward with chosen values and noise, and write the outputs as CSV.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// A parameter, constant or initial:STATE value; may be repeated. The rest stands at its prior median.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, f64)>,
    /// Amplitude of an effect of the study or of the built-in list; may be repeated.
    #[arg(long = "effect", value_name = "NAME=VALUE", value_parser = assignment)]
    effect: Vec<(String, f64)>,
    /// Standard deviation of Gaussian noise added to every output, in the output's unit.
    #[arg(long, default_value_t = 0.0, value_name = "SD")]
    noise: f64,
    /// Seed of the noise; the study's own without it.
    #[arg(long)]
    seed: Option<u64>,
    /// Record whose times and inputs are used; the first without it.
    #[arg(long)]
    record: Option<String>,
    /// End of a regular time grid from the record's start, together with --step.
    #[arg(long, requires = "step")]
    until: Option<f64>,
    /// Spacing of that grid.
    #[arg(long, requires = "until")]
    step: Option<f64>,
    /// Where to write the CSV; standard output without it.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// `NAME=VALUE` with a finite value.
fn assignment(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let value: f64 = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    if value.is_finite() {
        Ok((name.trim().to_owned(), value))
    } else {
        Err("the value must be finite".to_owned())
    }
}

/// Simulates and writes.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if !(args.noise >= 0.0 && args.noise.is_finite()) {
        return Err(Failure::input("--noise must be zero or a positive number"));
    }
    let study = Study::load(&args.study)?;
    let record = match &args.record {
        None => 0,
        Some(name) => study.records.iter().position(|r| r.name == *name).ok_or_else(|| {
            let names: Vec<&str> = study.records.iter().map(|r| r.name.as_str()).collect();
            Failure::input(format!("no record named `{name}` (the study has: {})", names.join(", ")))
        })?,
    };
    let twin = Twin {
        record,
        values: args.set.clone(),
        effects: args.effect.clone(),
        noise: args.noise,
        seed: args.seed.unwrap_or(study.seed),
        times: grid(args, &study, record)?,
    };
    let recording = simulate(&study, &twin).map_err(Failure::input)?;
    write(&recording, args)
}

/// The regular grid that was asked for; empty takes the record's own times.
fn grid(args: &Args, study: &Study, record: usize) -> Result<Vec<f64>, Failure> {
    let (Some(until), Some(step)) = (args.until, args.step) else { return Ok(Vec::new()) };
    let start = study.records[record].times.first().copied().unwrap_or_default();
    if !(step > 0.0 && until > start && (until - start) / step < 1e8) {
        return Err(Failure::input(format!(
            "--step must be positive and --until after the record's start at {start}"
        )));
    }
    let n = ((until - start) / step + 1e-9).floor() as usize;
    Ok((0..=n).map(|k| step.mul_add(k as f64, start)).collect())
}

fn write(recording: &Recording, args: &Args) -> Result<(), Failure> {
    let sink: Box<dyn std::io::Write> = match &args.output {
        Some(path) => Box::new(
            std::fs::File::create(path)
                .map_err(|e| Failure::input(format!("cannot write {}: {e}", path.display())))?,
        ),
        None => Box::new(std::io::stdout().lock()),
    };
    let mut csv = csv::Writer::from_writer(sink);
    let heading = std::iter::once("time").chain(recording.columns.iter().map(String::as_str));
    csv.write_record(heading).map_err(Failure::run)?;
    for (k, time) in recording.times.iter().enumerate() {
        let row = std::iter::once(*time).chain(recording.values.iter().map(|column| column[k]));
        csv.write_record(row.map(|v| format!("{v:?}"))).map_err(Failure::run)?;
    }
    csv.flush().map_err(Failure::run)
}
