//! `starlings run`: a study, a fleet, a run folder.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Parser;
use starlings_coordinator::fleet::Fleet;
use starlings_coordinator::live::LivePage;
use starlings_coordinator::metrics::Source;
use starlings_coordinator::report;
use starlings_coordinator::study::constants::HangsOn;
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::trial::{Depth, dry_run};
use starlings_coordinator::study::{Progress, RunContext, RunFolder, Study, Summary, run as study_run};

use crate::console::{line, note, number, table};
use crate::disk;
use crate::failure::Failure;
use crate::fleet_session::{Entrance, FleetArgs, FleetSession, Out, finish};
use crate::interrupt;
use crate::load::{is_outside, load_where};
use crate::progress::Display;
use crate::run_folder;

/// Times the sd as wide as which the quarter of an interval, about one sd of a normal distribution, tells the digits of its ends.
const FAR_WIDER: f64 = 10.0;

/// At most this many constants are told on the terminal.
const TOLD: usize = 3;

/// At most this many predictions are told on the terminal.
const PREDICTED: usize = 12;

/// Estimate the parameters of a study; writes posterior.csv, summary.json and report.html into a run folder.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// Run folder; runs/NAME-TIME without it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    fleet: FleetArgs,
    #[command(flatten)]
    resume: run_folder::Resume,
    /// Print the summary as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Runs the study.
pub(crate) fn run(args: &Args, started: Instant) -> Result<(), Failure> {
    interrupt::watch();
    let mut study = load_where(&args.study, args.fleet.is_here())?;
    let plan = args.fleet.plan(&study, Some(&Out(args.out.as_deref())))?.keeping_states();
    let kind = study.estimator.kind;
    let is_away = args.fleet.workers_try(&study);
    // What a solver answers for is found out by the trial, and may be needed again.
    let is_known = !is_outside(&study) && args.resume.was_tried(args.out.as_deref());
    if !is_away && !is_known {
        dry_run(&mut study, kind, Depth::First).map_err(Failure::input)?;
    }
    let entrance = Entrance::take(&plan, args.out.as_deref())?;
    let place = plan.place();
    disk::check_states(&study, place.as_deref(), !args.resume.is_first())?;
    let mut folder =
        run_folder::open(Purpose::Run, &study, args.out.as_deref(), place.is_some(), args.resume)?;
    if let Some(summary) = folder.summary().map_err(Failure::run)? {
        note(format_args!(
            "the run in {} is finished already; writing its files again",
            folder.path.display()
        ));
        report::write_files(&folder).map_err(Failure::run)?;
        return print(&summary, &folder.path, args.json);
    }
    let display = Display::new(args.json);
    let moved = run_folder::moved(&folder, place.as_deref())?.unwrap_or_default();
    let identity = folder.store.begin().map_err(Failure::run)?;
    let mut session = FleetSession::listen(&study, &plan, entrance, identity, &display)?;
    session.show(&study, "run", Some(&folder.path), &display)?;
    session.start_workers(&study, &plan, Some(&folder.path))?;
    if is_away && let Err(failure) = tried_by_workers(&mut session, &mut study, &folder) {
        let states = session.fleet.states().cloned().filter(|_| args.resume.is_first());
        session.close(false);
        if let Some(states) = states {
            states.clear();
        }
        run_folder::give_up(folder, args.resume);
        return Err(failure);
    }
    let mut watch = watching(session.source(), &display);
    let clock = move || started.elapsed().as_secs_f64();
    let mut context = RunContext {
        clock: &clock,
        watch: &mut watch,
        events: Some(&session.events),
        earlier_s: 0.0,
        threads: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
    };
    let result = study_run::run(&study, &mut session.fleet, &mut folder, &mut context);
    let page = session.close(result.is_ok());
    let path = folder.path.display();
    let summary = result.map_err(|error| {
        display.finish();
        let remedy = format!("the run so far is in {path}: continue it with --out {path} --resume");
        if error.is_cancelled() {
            return interrupt::failure(&remedy);
        }
        let moved = if error.misses_a_piece() { &*moved } else { "" };
        Failure::run(format!("{error}{moved}\n  {remedy}"))
    })?;
    end(&summary, &folder, page, &display, args.json)
}

/// Writes and prints the result, and leads the live page to its report.
fn end(
    summary: &Summary,
    folder: &RunFolder,
    page: Option<LivePage>,
    display: &Display,
    json: bool,
) -> Result<(), Failure> {
    let written = report::write_files(folder);
    display.finish();
    written.map_err(Failure::run)?;
    let printed = print(summary, &folder.path, json);
    finish(page, Some(&folder.path.join("report.html")));
    folder.rest();
    printed
}

/// The trial by the workers; its states stand where those of the run will.
fn tried_by_workers(
    session: &mut FleetSession,
    study: &mut Study,
    folder: &RunFolder,
) -> Result<(), Failure> {
    folder.settle_states_of_trial(session.fleet.states()).map_err(Failure::run)?;
    let kind = study.estimator.kind;
    session.trial(study, Some(kind), Some(&folder.store))
}

/// Counts every analysis, and shows where the run stands.
fn watching(source: Source, display: &Display) -> impl FnMut(&Progress) {
    move |at| {
        if at.is_analysis() {
            source.analysed();
        }
        display.step(at);
    }
}

/// The estimates with their intervals: both, that given the residuals first, where they differ much, else that at the stated noise.
fn estimates(summary: &Summary) -> Vec<Vec<String>> {
    let both = summary.residuals_first();
    let intervals: &[&str] =
        if both { &["95 % given the residuals", "95 % at the stated noise"] } else { &["95 % interval"] };
    let head = ["parameter", "unit", "estimate"].iter().chain(intervals).chain(&["prior median"]);
    let mut rows = vec![head.map(|title| (*title).to_owned()).collect::<Vec<_>>()];
    let text = |ends: [f64; 2], sd| format!("{} … {}", bound(ends[0], ends, sd), bound(ends[1], ends, sd));
    for p in &summary.parameters {
        let given = p.interval95_given_residuals.zip(p.sd_given_residuals).filter(|_| both);
        let sd = given.map_or(p.sd, |(_, sd)| sd);
        let mut row = vec![p.name.clone(), p.unit.clone(), number(p.estimate, Some(sd))];
        row.extend(given.map(|(ends, sd)| text(ends, sd)));
        row.push(text(p.interval95, p.sd));
        row.push(number(p.prior_median, None));
        rows.push(row);
    }
    rows
}

/// An end of an interval, with the digits that the sd justifies, or those of its width where that is far more than any number of them: the ends
/// of a logarithm that is not known have no digits in the units of the sd at the estimate.
fn bound(value: f64, [lo, hi]: [f64; 2], sd: f64) -> String {
    let width = 0.25 * (hi - lo);
    number(value, Some(if width > FAR_WIDER * sd { width } else { sd }))
}

/// What the residuals say of intervals that stand alone in the table.
fn alike(summary: &Summary) -> Option<String> {
    let wider = summary.wider_given_residuals().filter(|_| !summary.residuals_first())?;
    Some(format!("given the residuals the intervals are at most {wider:.2} times as wide"))
}

fn print(summary: &Summary, folder: &Path, json: bool) -> Result<(), Failure> {
    if json {
        return line(serde_json::to_string_pretty(summary).map_err(Failure::run)?);
    }
    for warning in &summary.warnings {
        line(format_args!("warning: {warning}"))?;
    }
    line(format_args!("\n{}", table(&estimates(summary), false)))?;
    if let Some(alike) = alike(summary) {
        line(alike)?;
    }
    let shown = |rmse: Option<f64>| rmse.map_or_else(|| "–".to_owned(), |v| number(v, None));
    for c in &summary.fit.channels {
        line(format_args!(
            "{}: RMSE {} on the training span, {} held out (noise {})",
            c.name,
            shown(c.train_rmse),
            shown(c.held_out_rmse),
            number(c.noise, None)
        ))?;
    }
    if !summary.predictions.is_empty() {
        line(format_args!("\n{}", table(&predictions(summary), false)))?;
    }
    if let Some(found) = &summary.hangs_on {
        hangs_on(found)?;
    }
    line(format_args!(
        "{} runs ({} failed, {} retried) on {} worker{} in {:.2} s; NIS {:.2} per observation",
        summary.runs.total,
        summary.runs.failed,
        summary.runs.retried,
        summary.workers,
        if summary.workers == 1 { "" } else { "s" },
        summary.wall_s,
        summary.fit.nis_per_observation
    ))?;
    line(format_args!("report: {}", folder.join("report.html").display()))
}

/// What was predicted, measured or not: mean, lowest and highest value over each record.
fn predictions(summary: &Summary) -> Vec<Vec<String>> {
    let names = ["predicted", "unit", "record"].into_iter();
    let titles = summary.predictions[0].figures().map(|(title, _)| title);
    let head = names.chain(titles.into_iter().flat_map(|title| [title, "95 %"]));
    let mut rows = vec![head.map(str::to_owned).collect::<Vec<_>>()];
    for p in summary.predictions.iter().take(PREDICTED) {
        let mut row = vec![p.output.clone(), p.unit.clone(), p.record.clone()];
        for (_, figure) in p.figures() {
            let [lo, hi] = figure.interval95;
            // An interval of 95 % is about four sd long.
            let sd = Some(0.25 * (hi - lo));
            row.extend([number(figure.estimate, sd), format!("{} … {}", number(lo, sd), number(hi, sd))]);
        }
        rows.push(row);
    }
    let more = summary.predictions.len().saturating_sub(PREDICTED);
    if more > 0 {
        rows.push(vec![format!("{more} more in predicted.csv")]);
    }
    rows
}

/// The constants that matter most, in a sentence each.
pub(crate) fn hangs_on(found: &HangsOn) -> Result<(), Failure> {
    for sentence in found.sentences(TOLD) {
        line(format_args!("hangs on a constant: {sentence}"))?;
    }
    line(moved(found.constants.len(), found.runs))
}

/// How many constants were moved, and in how many runs.
fn moved(n: usize, runs: u64) -> String {
    let constants = if n == 1 { "constant" } else { "constants" };
    format!("{n} {constants} moved by 1 %, {runs} runs: all figures are in the report")
}

#[cfg(test)]
mod tests {
    use super::{bound, moved};

    #[test]
    fn the_ends_of_an_interval_have_the_digits_of_their_sd_or_of_a_width_that_is_out_of_proportion() {
        let both = |ends: [f64; 2], sd| ends.map(|value| bound(value, ends, sd));
        assert_eq!(both([0.9804, 1.0196], 0.01), ["0.980", "1.020"]);
        assert_eq!(both([1.8e-15, 7.630_362_043_476e10], 0.0057)[1], "7.6e10");
    }

    #[test]
    fn one_constant_is_a_constant() {
        assert_eq!(moved(1, 4), "1 constant moved by 1 %, 4 runs: all figures are in the report");
        assert_eq!(moved(2, 6), "2 constants moved by 1 %, 6 runs: all figures are in the report");
    }
}
