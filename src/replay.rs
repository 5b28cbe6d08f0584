//! `starlings replay`: a run of a sigma point again, with the inputs that it had.
//!
//! Next file to read: [`again`].

use std::path::PathBuf;

use clap::Parser;
use starlings_coordinator::fleet::RunIdentity;
use starlings_coordinator::study::replay::{Asked, Replay, ReplayError, Target, replay as again};
use starlings_coordinator::study::trial::{Depth, dry_run};
use starlings_coordinator::study::{RunFolder, Study};

use crate::console::{line, text};
use crate::disk;
use crate::failure::Failure;
use crate::fleet_session::{Entrance, FleetArgs, FleetSession, finish};
use crate::interrupt;
use crate::load;
use crate::progress::Display;

/// Make a run of a sigma point again, with the inputs that it had, and say whether outputs and end state have the same bits here.
///
/// Where the inputs of the analysis are not in the store themselves, the analyses since the last ones that are rebuild them, each
/// compared on the way. Nothing is written. Exit code 1 says that the bits are others.
#[derive(Parser)]
pub(crate) struct Args {
    /// The run folder.
    dir: PathBuf,
    /// Number of the particle, from 0.
    particle: u32,
    /// Pass, from 1; the last one without it.
    #[arg(long, value_name = "N")]
    pass: Option<usize>,
    /// Analysis within the pass, or iteration of a batch fit, from 0, as `starlings why` counts; without it the last one whose inputs are
    /// stored.
    #[arg(long, value_name = "N")]
    analysis: Option<usize>,
    /// The study file, if it does not stand where it was run; only its place matters, its text is that of the run.
    #[arg(long, value_name = "FILE")]
    study: Option<PathBuf>,
    #[command(flatten)]
    fleet: FleetArgs,
    /// Print the answer as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Makes the run again and compares.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    interrupt::watch();
    let folder = RunFolder::open(&args.dir).map_err(Failure::input)?;
    let asked = Asked { particle: args.particle, pass: args.pass, analysis: args.analysis };
    let target = Target::find(&folder, &asked).map_err(|error| failed(&error))?;
    let mut study = load::of_run(&folder, args.study.as_deref(), args.fleet.is_here())?;
    let found = on_fleet(args, &mut study, &folder, &target)?;
    if args.json {
        line(
            serde_json::to_string_pretty(&Printed { agrees: found.is_same(), found: &found })
                .map_err(Failure::run)?,
        )?;
    } else {
        text(words(&found))?;
    }
    if found.is_same() {
        return Ok(());
    }
    Err(Failure::Answered("the run does not give the same bits here".to_owned()))
}

/// The answer, and in a word what it comes to.
#[derive(serde::Serialize)]
struct Printed<'a> {
    agrees: bool,
    #[serde(flatten)]
    found: &'a Replay,
}

fn on_fleet(args: &Args, study: &mut Study, folder: &RunFolder, target: &Target) -> Result<Replay, Failure> {
    let kind = study.estimator.kind;
    let plan = args.fleet.plan(study, None)?;
    let is_away = args.fleet.workers_try(study);
    if !is_away {
        dry_run(study, kind, Depth::First).map_err(Failure::input)?;
    }
    disk::check_states(study, plan.place().as_deref(), false)?;
    let display = Display::new(args.json);
    let entrance = Entrance::take(&plan, None)?;
    let mut session = FleetSession::listen(study, &plan, entrance, RunIdentity::new(), &display)?;
    session.show(study, "replay", None, &display)?;
    session.start_workers(study, &plan, None)?;
    if is_away {
        session.trial(study, Some(kind), None)?;
    }
    if target.n_before() > 0 {
        display.say(&format!(
            "the inputs of analysis {} follow from those of analysis {}: {} before it are made again",
            target.analysis,
            target.from,
            counted(target.n_before(), "analysis", "analyses")
        ));
    }
    let result = again(study, &mut session.fleet, folder, target);
    display.finish();
    finish(session.close(result.is_ok()), None);
    result.map_err(|error| failed(&error))
}

fn failed(error: &ReplayError) -> Failure {
    if error.is_cancelled() {
        return interrupt::failure("nothing was written: start again");
    }
    if error.is_input() { Failure::input(error) } else { Failure::run(error) }
}

/// The answer in words.
fn words(found: &Replay) -> String {
    let mut lines =
        vec![format!("particle {} at pass {}, analysis {}", found.particle, found.pass, found.analysis)];
    if let Some(earlier) = &found.earlier {
        lines.push(format!(
            "it cannot be given the inputs that it had: particle {} at analysis {}, which they follow from, is not the same here",
            earlier.particle, earlier.analysis
        ));
        lines.push(format!("  {}", earlier.says()));
    }
    let values =
        found.runs.first().map(|run| run.values.iter().map(|(name, value)| format!("{name} = {value:?}")));
    if let Some(values) = values {
        lines.push(format!("with {}", values.collect::<Vec<_>>().join(", ")));
    }
    lines.extend(found.runs.iter().map(|run| format!("  {}", run.says())));
    lines.extend(found.changed.iter().map(|change| format!("changed since: {change}")));
    let n_run = usize::try_from(found.n_run).unwrap_or(usize::MAX);
    lines.push(format!("{} made\n", counted(n_run, "run", "runs")));
    lines.join("\n")
}

fn counted(n: usize, one: &str, many: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {many}") }
}
