//! `starlings forecast`: what a run or an inference says of the future.
//!
//! Next file to read: `forecast/source.rs`, which opens either.

mod source;

use std::path::{Path, PathBuf};

use clap::Parser;
use starlings_coordinator::fleet::RunIdentity;
use starlings_coordinator::report::forecast_page;
use starlings_coordinator::study::forecast::result::OutputForecast;
use starlings_coordinator::study::forecast::{Ask, Forecast, Threshold};
use starlings_estimators::forecast::{Direction, Level};

use crate::console::{line, note, table, text};
use crate::csv_file;
use crate::failure::Failure;
use crate::fleet_session::{Entrance, FleetArgs, FleetSession, finish};
use crate::progress::Display;
use source::Source;

/// Forecast from a run or an inference: an ensemble with parameters from its posterior, quantiles against time, and the time at which a
/// quantity crosses a level.
///
/// Every member of a run starts where the record does, with parameters drawn from the posterior and, where the model has it, with noise of
/// its own. From an inference members start at the last row, with coefficients and noise drawn from its posterior. Writes forecast.json,
/// fan.csv, crossing-times.csv and report.html.
#[derive(Parser)]
pub(crate) struct Args {
    /// The folder of a finished run or inference, or the state file of `starlings infer --follow`.
    #[arg(value_name = "DIR|STATE")]
    from: PathBuf,
    /// A value that all members have, of a parameter, constant or initial:STATE; may be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = crate::simulate::assignment)]
    set: Vec<(String, f64)>,
    /// Last time of the forecast; the record's end without it, which is none where an inference used all of it. Inputs stay at their last value beyond theirs.
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    until: Option<f64>,
    /// Spacing of times after the record's end; its mean spacing without it.
    #[arg(long, value_name = "STEP", allow_negative_numbers = true)]
    step: Option<f64>,
    /// A level, as "pressure>5" or "level<0.2": when is it crossed? May be repeated.
    #[arg(long = "level", value_name = "OUTPUT>VALUE", value_parser = threshold)]
    level: Vec<Threshold>,
    /// Time by which the probability of a crossing is wanted.
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    horizon: Option<f64>,
    /// Members of the ensemble.
    #[arg(long, value_name = "N", default_value_t = 200)]
    members: usize,
    /// Seed of draws and noise; the study's own without it.
    #[arg(long)]
    seed: Option<u64>,
    /// Record whose start, inputs and times are used; the first without it.
    #[arg(long)]
    record: Option<String>,
    /// The study file: of a state file always, else where it does not stand any more where it was run. Its recordings are looked for
    /// beside it.
    #[arg(long, value_name = "FILE")]
    study: Option<PathBuf>,
    /// Folder for the files; without it `forecast` in the folder, and beside STATE its name with `-forecast`.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    fleet: FleetArgs,
    /// Print the result as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `output>value` or `output<value`.
fn threshold(text: &str) -> Result<Threshold, String> {
    let (at, direction) = match (text.find('>'), text.find('<')) {
        (Some(at), None) => (at, Direction::Above),
        (None, Some(at)) => (at, Direction::Below),
        _ => return Err("expected OUTPUT>VALUE or OUTPUT<VALUE, such as \"pressure>5\"".to_owned()),
    };
    let (output, value) = (text[..at].trim(), text[at + 1..].trim());
    let value: f64 = value.parse().map_err(|_| format!("`{value}` is not a number"))?;
    if output.is_empty() || !value.is_finite() {
        return Err("expected the name of an output and a finite level".to_owned());
    }
    Ok(Threshold { output: output.to_owned(), level: Level { value, direction } })
}

/// Runs the ensemble and writes what it says.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let source = Source::open(args)?;
    let study = &source.study;
    let ask = ask(args, &source)?;
    source.check(&ask)?;
    let plan = args.fleet.plan(study, None)?;
    let display = Display::new(args.json);
    let mut session =
        FleetSession::listen(study, &plan, Entrance::take(&plan, None)?, RunIdentity::new(), &display)?;
    session.show(study, "forecast", None, &display)?;
    session.start_workers(study, &plan, None)?;
    let result = source.forecast(&mut session.fleet, &ask, &mut |at| display.stage(at));
    display.finish();
    let page = session.close(result.is_ok());
    let found = result?;
    let out = args.out.clone().unwrap_or_else(|| usual_out(&args.from));
    let json = serde_json::to_string_pretty(&found).map_err(Failure::run)?;
    write(&out, &found, &json)?;
    finish(page, Some(&out.join("report.html")));
    if args.json {
        return line(json);
    }
    print(&found)?;
    note(format_args!("written: {}", out.join("report.html").display()));
    Ok(())
}

/// `forecast` in a folder; beside a state file, its name with `-forecast`.
fn usual_out(from: &Path) -> PathBuf {
    if from.is_dir() {
        return from.join("forecast");
    }
    let stem = from.file_stem().unwrap_or_default().to_string_lossy();
    from.with_file_name(format!("{stem}-forecast"))
}

fn ask(args: &Args, source: &Source) -> Result<Ask, Failure> {
    Ok(Ask {
        record: source.record(args.record.as_deref())?,
        values: args.set.clone(),
        until: args.until,
        step: args.step,
        thresholds: args.level.clone(),
        horizon: args.horizon,
        members: args.members,
        seed: args.seed.unwrap_or(source.study.seed),
    })
}

fn write(out: &Path, found: &Forecast, json: &str) -> Result<(), Failure> {
    let cannot =
        |path: &Path, e: std::io::Error| Failure::input(format!("cannot write {}: {e}", path.display()));
    std::fs::create_dir_all(out).map_err(|e| cannot(out, e))?;
    let page = forecast_page(found).map_err(Failure::run)?;
    for (name, text) in [("forecast.json", json), ("report.html", page.as_str())] {
        let path = out.join(name);
        starlings_coordinator::study::store::folder::write(&path, text).map_err(|e| cannot(&path, e))?;
    }
    csv_file::write(Some(&out.join("fan.csv")), found.fan_table())?;
    csv_file::write(Some(&out.join("crossing-times.csv")), found.crossing_table())
}

fn print(found: &Forecast) -> Result<(), Failure> {
    line(format_args!(
        "{}: {} members of model {} up to {} {}",
        found.study, found.members, found.model, found.until, found.time_unit
    ))?;
    for warning in &found.warnings {
        line(format_args!("warning: {warning}"))?;
    }
    for level in &found.levels {
        line(&level.says)?;
        if let Some([lo, hi]) = level.interval90 {
            line(format_args!("  90 % of the members between {lo:.4} and {hi:.4}"))?;
        }
        if let (Some(horizon), Some(p)) = (level.horizon, level.probability_by_horizon) {
            line(format_args!("  by {horizon}: probability {p:.3}"))?;
        }
    }
    let heading = [
        "output",
        "unit",
        "median at the end",
        "quantity 5 to 95 %",
        "measured 5 to 95 %",
        "errors",
        "fitted in 90 %",
        "held out in 90 %",
    ];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    rows.extend(found.outputs.iter().map(row));
    text(table(&rows, false))?;
    line(&found.conditional_on)
}

/// The row of an output: both bands at the end, the errors of what would be measured, and what its band holds.
fn row(output: &OutputForecast) -> Vec<String> {
    let share = |of: Option<f64>| of.map_or_else(String::new, |v| format!("{:.1} %", 100.0 * v));
    let [median, lo, hi] = output.at_end.map(|v| format!("{v:.5}"));
    let coverage = output.coverage90;
    vec![
        output.output.clone(),
        output.unit.clone(),
        median,
        format!("{lo} to {hi}"),
        output.measured_at_end.map_or_else(String::new, |[lo, hi]| format!("{lo:.5} to {hi:.5}")),
        output.errors.map_or_else(String::new, |errors| format!("{:.4}", errors.sd)),
        share(coverage.and_then(|c| c.train)),
        share(coverage.and_then(|c| c.held_out)),
    ]
}
