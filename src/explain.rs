//! `starlings explain`: where simulation and recordings disagree, which effect is missing, the gap before and after.
//!
//! Next files to read: [`mod@print`] for the answer on a terminal, [`crate::fleet_session`] for the fleet.

mod drift;
mod print;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Parser;
use starlings_coordinator::explain::{
    Context, ExplainError, Explanation, Findings, Options, check, explain, load_findings, save_findings,
};
use starlings_coordinator::report::{self, FilesError};
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::trial::trial;
use starlings_coordinator::study::{RunFolder, Stage, Study};

use crate::console::{line, note};
use crate::disk;
use crate::failure::Failure;
use crate::fleet_session::{Entrance, FleetArgs, FleetSession, Out, finish};
use crate::interrupt;
use crate::load::{is_outside, load_where};
use crate::progress::Display;
use crate::run_folder;

/// Say where simulation and recordings disagree, name the missing effect, add it, and show the gap before and after.
///
/// The model is fitted as it is, then with one effect after another (`starlings effects STUDY` lists them), on the training
/// spans only; held-out spans and channels decide. The run folder receives explain.json, report.html and, when an effect was
/// named, explained.toml: the study with the effect in it, for `starlings run`. Of a study with `[infer]`, which has noise in its states,
/// terms that the drift lacks are named by the statistics of `starlings infer`.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// Run folder; runs/NAME-explain-TIME without it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    fleet: FleetArgs,
    #[command(flatten)]
    resume: run_folder::Resume,
    /// Runs of the model at most (one particle over one record each); what is left untried is reported.
    #[arg(long, value_name = "RUNS")]
    budget: Option<u64>,
    /// Leave out this effect, at all of its places where none is named (may be given several times).
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
    /// Try this effect and no other, at all of its places where none is named (may be given several times).
    #[arg(long, value_name = "EFFECT")]
    only: Vec<String>,
    /// Effects at most in one explanation.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=3))]
    max_effects: Option<u8>,
    /// Go on although the fit of the model as it is has not converged.
    #[arg(long)]
    force: bool,
    /// Measure the false-alarm rate: search N recordings simulated from the fitted model, in which nothing is missing.
    #[arg(long = "null", value_name = "N", default_value_t = 0)]
    nulls: usize,
    /// Print the explanation as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Args {
    /// What the study asks for, and the command line above it.
    fn options(&self, study: &Study) -> Options {
        let mut options = Options::of(study);
        options.budget = self.budget.or(options.budget);
        options.without.extend(self.without.iter().cloned());
        if !self.only.is_empty() {
            options.only.clone_from(&self.only);
        }
        options.max_effects = self.max_effects.map_or(options.max_effects, usize::from);
        options.force = self.force;
        options.nulls = self.nulls;
        options
    }
}

/// Explains the study's misfit.
pub(crate) fn run(args: &Args, started: Instant) -> Result<(), Failure> {
    if Study::asks_to_infer(&args.study) {
        return drift::run(args);
    }
    interrupt::watch();
    let mut study = load_where(&args.study, args.fleet.is_here())?;
    let plan = args.fleet.plan(&study, Some(&Out(args.out.as_deref())))?;
    let options = args.options(&study);
    check(&study, &options).map_err(Failure::input)?;
    let is_away = args.fleet.workers_try(&study);
    // What a solver answers for is found out by the trial, and may be needed again.
    let is_known = !is_outside(&study) && args.resume.was_tried(args.out.as_deref());
    if !is_away && !is_known {
        trial(&study).map_err(Failure::input)?;
    }
    disk::check_states(&study, plan.place().as_deref(), !args.resume.is_first())?;
    let entrance = Entrance::take(&plan, args.out.as_deref())?;
    let folder = run_folder::open(
        Purpose::Explanation,
        &study,
        args.out.as_deref(),
        plan.place().is_some(),
        args.resume,
    )?;
    if load_findings(&folder.store).map_err(Failure::run)?.is_some() {
        let path = folder.path.display();
        note(format_args!("the explanation in {path} is finished already; writing its files again"));
        return write(&folder, args.json);
    }
    let display = Display::new(args.json);
    let identity = folder.store.begin().map_err(Failure::run)?;
    let mut session = FleetSession::listen(&study, &plan, entrance, identity, &display)?;
    session.show(&study, "explain", Some(&folder.path), &display)?;
    session.start_workers(&study, &plan, Some(&folder.path))?;
    if is_away && let Err(failure) = session.trial(&mut study, None, Some(&folder.store)) {
        session.close(false);
        run_folder::give_up(folder, args.resume);
        return Err(failure);
    }
    let mut watch = |stage: &Stage| {
        display.stage(stage);
        // Who looks at the folder may miss it; the explanation does not depend on it.
        if stage.work.next <= 0.0 {
            let _ = stage.note(&folder.store);
        }
    };
    let clock = move || started.elapsed().as_secs_f64();
    let earlier_s = folder.store.elapsed_s().map_err(Failure::run)?;
    let mut context = Context { clock: &clock, watch: &mut watch, events: Some(&session.events), earlier_s };
    let result = explain(&study, &mut session.fleet, &folder.store, &mut context, &options);
    if result.is_err() {
        display.finish();
    }
    let page = session.close(result.is_ok());
    let found = result.map_err(|error| failed(&error, &folder.path))?;
    let written = save_findings(&folder, &found).map_err(Failure::run).and_then(|()| files(&folder));
    display.finish();
    let written = written.and_then(|found| told(&found, &folder, args.json));
    finish(page, Some(&folder.path.join("report.html")));
    folder.rest();
    written
}

/// What is left of an explanation that ended early, and how to go on from there.
fn failed(error: &ExplainError, folder: &Path) -> Failure {
    let path = folder.display();
    match error {
        ExplainError::NotConverged { .. } => Failure::input(format!(
            "{error}\n  its runs are kept: --out {path} --resume --force goes on from there"
        )),
        _ if error.is_input() => Failure::input(error),
        _ => {
            let remedy =
                format!("the explanation so far is in {path}: continue it with --out {path} --resume");
            if error.is_cancelled() {
                return interrupt::failure(&remedy);
            }
            Failure::run(format!("{error}\n  {remedy}"))
        }
    }
}

/// Writes the files of a finished explanation and prints its answer.
pub(crate) fn write(folder: &RunFolder, json: bool) -> Result<(), Failure> {
    told(&files(folder)?, folder, json)
}

/// Writes the files of a finished explanation.
fn files(folder: &RunFolder) -> Result<Findings, Failure> {
    report::write_explanation(folder).map_err(|error| match error {
        FilesError::Unfinished(_) => Failure::input(error),
        _ => Failure::run(error),
    })
}

/// Prints the answer of an explanation.
fn told(found: &Findings, folder: &RunFolder, json: bool) -> Result<(), Failure> {
    if json {
        return as_json(&found.explanation);
    }
    print::print(&found.explanation, &report::state_names(folder).map_err(Failure::run)?, &folder.path)
}

fn as_json(explanation: &Explanation) -> Result<(), Failure> {
    line(serde_json::to_string_pretty(explanation).map_err(Failure::run)?)
}
