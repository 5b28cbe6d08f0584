//! `starlings infer`: drift and noise of stochastic equations from recordings of all their states.
//!
//! Next files to read: [`mod@print`] for the answer on a terminal, [`crate::fleet_session`] for the fleet.

mod followed;
pub(crate) mod print;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Parser;
use serde_json::json;
use starlings_coordinator::fleet::RunIdentity;
use starlings_coordinator::infer::{InferError, Inference, Progress, Reader, check, infer, outlook};
use starlings_coordinator::live::LivePage;
use starlings_coordinator::report::write_inference;
use starlings_coordinator::study::Study;

use crate::console::line;
use crate::failure::Failure;
use crate::fleet_session::{Entrance, FleetArgs, FleetSession, Out, finish};
use crate::interrupt;
use crate::progress::Display;

/// Name of the result in its folder.
pub(crate) const RESULT: &str = "infer.json";

/// Infer drift and noise of stochastic equations, with intervals, from recordings of all their states.
///
/// The study has equations with states that are measured as they are, and a section `[infer]` that says which coefficients are
/// unknown. Sums over blocks of the recordings are made by the workers; the posterior is a formula over them. The folder
/// receives study.toml, infer.json, coefficients.csv and report.html.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// Folder of the result; runs/NAME-infer-TIME without it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Follow a recording that is still written: rows of this CSV file, or of standard input (`-`), with the columns of the study's
    /// first record. Standard output receives a line of JSON per block: coefficients, noise, the test for a change. It ends where the
    /// file ends; `tail -n +1 -f FILE | starlings infer STUDY --follow -` goes on while the file grows. A last line that no line break
    /// ends is not taken. No folder is written and no worker is started.
    #[arg(long, value_name = "FILE|-", conflicts_with_all = ["out", "workers", "listen", "json"])]
    follow: Option<PathBuf>,
    /// With --follow: write what a restart goes on from into this file after every block, and go on from it where it is there.
    #[arg(long, value_name = "FILE", requires = "follow")]
    state: Option<PathBuf>,
    #[command(flatten)]
    fleet: FleetArgs,
    /// Print the inference as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Args {
    /// Whether rows come from standard input.
    pub(crate) fn follows_standard_input(&self) -> bool {
        self.follow.as_ref().is_some_and(|source| source.as_os_str() == "-")
    }
}

/// Infers, and writes the folder.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    interrupt::watch();
    let study = Study::load_for_inference(&args.study)?;
    if let Some(source) = &args.follow {
        return followed::run(&study, source, args.state.clone());
    }
    let display = Display::new(args.json);
    let made = make(&study, "infer", (&args.fleet, args.out.as_deref()), &display)?;
    let told = tell(&made.found, &made.folder, args.json);
    finish(made.page, Some(&made.folder.join("report.html")));
    told
}

/// An inference in its folder.
pub(crate) struct Made {
    pub(crate) found: Inference,
    pub(crate) folder: PathBuf,
    /// The live page, where there is one.
    pub(crate) page: Option<LivePage>,
}

/// Infers for a command on its fleet, and writes the folder of the result.
pub(crate) fn make(
    study: &Study,
    command: &str,
    (fleet, out): (&FleetArgs, Option<&Path>),
    display: &Arc<Display>,
) -> Result<Made, Failure> {
    check(study).map_err(|error| failed(&error))?;
    let plan = fleet.plan(study, Some(&Out(out)))?;
    let entrance = Entrance::take(&plan, out)?;
    let folder = folder(study, command, out)?;
    let mut session = FleetSession::listen(study, &plan, entrance, RunIdentity::new(), display)?;
    session.show(study, command, None, display)?;
    session.start_workers(study, &plan, Some(&folder))?;
    let mut watch = |at: &Progress| display.blocks(at);
    let reader = if fleet.is_here() { Reader::Workers } else { Reader::Coordinator };
    let result = infer(study, &mut session.fleet, reader, &mut watch);
    display.finish();
    let page = session.close(result.is_ok());
    let found = result.map_err(|error| failed(&error))?;
    write_study(study, &folder)?;
    write_inference(&folder, &found).map_err(Failure::run)?;
    Ok(Made { found, folder, page })
}

/// Says what an inference would do, for `starlings check`.
pub(crate) fn check_only(path: &Path, json: bool) -> Result<(), Failure> {
    let study = Study::load_for_inference(path)?;
    let found = outlook(&study).map_err(|error| failed(&error))?;
    let records = found.records.iter();
    if json {
        let records =
            records.map(|(name, step, rows)| json!({ "name": name, "step": step, "rows": rows.round() }));
        return line(format_args!(
            "{:#}",
            json!({
                "study": study.name,
                "equations": found.equations,
                "functions": found.n_function,
                "coefficients": found.coefficients,
                "records": records.collect::<Vec<_>>(),
            })
        ));
    }
    line(format_args!("{}: `starlings infer` takes this study; nothing was computed", study.name))?;
    line(format_args!("equations     {}", found.equations.join(", ")))?;
    line(format_args!("functions     {}", found.n_function))?;
    line(format_args!("coefficients  {}: {}", found.coefficients.len(), found.coefficients.join(", ")))?;
    for (name, step, rows) in records {
        line(format_args!(
            "record        {name}: steps of {step} {}, about {rows:.0} rows",
            study.time_unit
        ))?;
    }
    Ok(())
}

/// Writes the files of an inference again from its result.
pub(crate) fn write_again(folder: &Path, overview: bool, json: bool) -> Result<(), Failure> {
    if overview {
        return Err(Failure::input("an inference has no overview picture: leave out --overview"));
    }
    let found = read_result(folder)?;
    write_inference(folder, &found).map_err(Failure::run)?;
    tell(&found, folder, json)
}

/// The result in its folder.
pub(crate) fn read_result(folder: &Path) -> Result<Inference, Failure> {
    let path = folder.join(RESULT);
    let unreadable =
        |error: &dyn std::fmt::Display| Failure::input(format!("cannot read {}: {error}", path.display()));
    let text = std::fs::read_to_string(&path).map_err(|error| unreadable(&error))?;
    serde_json::from_str(&text).map_err(|error| unreadable(&error))
}

fn tell(found: &Inference, folder: &Path, json: bool) -> Result<(), Failure> {
    if json {
        return line(serde_json::to_string_pretty(found).map_err(Failure::run)?);
    }
    print::print(found, folder)
}

/// The folder of the result of a command, made where it is not there; another result in it is refused.
pub(crate) fn folder(study: &Study, command: &str, out: Option<&Path>) -> Result<PathBuf, Failure> {
    let stamp = jiff::Timestamp::now().strftime("%Y%m%d-%H%M%S");
    let default = || Path::new("runs").join(format!("{}-{command}-{stamp}", study.name));
    let path = out.map_or_else(default, Path::to_owned);
    for name in [RESULT, crate::diagnose::RESULT, "run.db"] {
        if path.join(name).exists() {
            let message =
                format!("{} holds a result already: give another --out, or remove it", path.display());
            return Err(Failure::input(message));
        }
    }
    std::fs::create_dir_all(&path)
        .map_err(|error| Failure::input(format!("cannot make the folder {}: {error}", path.display())))?;
    Ok(path)
}

/// Writes the study as it was read into the folder of its result.
pub(crate) fn write_study(study: &Study, folder: &Path) -> Result<(), Failure> {
    let path = folder.join("study.toml");
    std::fs::write(&path, &*study.text)
        .map_err(|error| Failure::run(format!("cannot write {}: {error}", path.display())))
}

fn failed(error: &InferError) -> Failure {
    if error.is_cancelled() {
        return interrupt::failure("nothing is kept of it: start again");
    }
    if error.is_input() { Failure::input(error) } else { Failure::run(error) }
}
