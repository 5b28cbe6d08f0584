//! `starlings diagnose`: whether a recording shows a fault, since when, and which scenario of a library it followed.
//!
//! Next files to read: [`mod@print`] for the answer on a terminal, [`crate::fleet_session`] for the fleet.

mod print;

use std::path::{Path, PathBuf};

use clap::Parser;
use serde_json::json;
use starlings_coordinator::diagnose::{DiagnoseError, Diagnosed, diagnose};
use starlings_coordinator::fleet::RunIdentity;
use starlings_coordinator::report::write_diagnosis;
use starlings_coordinator::study::Study;

use crate::console::line;
use crate::failure::Failure;
use crate::fleet_session::{Entrance, FleetArgs, FleetSession, Out, finish};
use crate::infer::{folder, write_study};
use crate::interrupt;
use crate::load::host;
use crate::progress::Display;

/// Name of the result in its folder.
pub(crate) const RESULT: &str = "diagnose.json";

/// Say whether a recording shows a fault, since when, and which scenario of a library it followed, how severe.
///
/// The study is the model without a fault; its section `[diagnose]` lists scenarios, each with unknowns of its own, values and inputs. All
/// of them are fitted to the recording on the fleet. The folder receives study.toml, diagnose.json, scenarios.csv and report.html.
#[derive(Parser)]
pub(crate) struct Args {
    /// The study file.
    study: PathBuf,
    /// Folder of the result; runs/NAME-diagnose-TIME without it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    fleet: FleetArgs,
    /// Print the diagnosis as JSON on standard output and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Diagnoses, and writes the folder.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    interrupt::watch();
    let diagnosis = Study::load_for_diagnosis(&args.study, &host(args.fleet.is_here()))?;
    let study = &diagnosis.healthy;
    let plan = args.fleet.plan(study, Some(&Out(args.out.as_deref())))?;
    let entrance = Entrance::take(&plan, args.out.as_deref())?;
    let folder = folder(study, "diagnose", args.out.as_deref())?;
    let display = Display::new(args.json);
    let mut session = FleetSession::listen(study, &plan, entrance, RunIdentity::new(), &display)?;
    session.show(study, "diagnose", None, &display)?;
    session.start_workers(study, &plan, Some(&folder))?;
    let result = diagnose(&diagnosis, &mut session.fleet, &mut |at| display.stage(at));
    display.finish();
    let page = session.close(result.is_ok());
    let found = result.map_err(|error| failed(&error))?;
    write_study(study, &folder)?;
    write_diagnosis(&folder, &found).map_err(Failure::run)?;
    let told = tell(&found, &folder, args.json);
    finish(page, Some(&folder.join("report.html")));
    told
}

/// Says what a diagnosis would compare, for `starlings check`.
pub(crate) fn check_only(path: &Path, as_json: bool) -> Result<(), Failure> {
    let diagnosis = Study::load_for_diagnosis(path, &host(true))?;
    let study = &diagnosis.healthy;
    let scenarios = || diagnosis.scenarios.iter();
    if as_json {
        let scenarios = scenarios().map(|s| {
            let own = &s.study.theta[diagnosis.severity()..];
            json!({
                "name": s.name,
                "severity": own.first().map(|entry| &entry.name),
                "parameters": own.iter().map(|entry| &entry.name).collect::<Vec<_>>(),
                "starts": s.n_start(),
                "warnings": s.study.warnings,
            })
        });
        let found = json!({
            "study": study.name,
            "model": study.setup.model.kind,
            "false_alarm": diagnosis.false_alarm,
            "scenarios": scenarios.collect::<Vec<_>>(),
            "warnings": study.warnings,
        });
        return line(format_args!("{found:#}"));
    }
    line(format_args!("{}: `starlings diagnose` takes this study; nothing was run", study.name))?;
    for warning in &study.warnings {
        line(format_args!("warning: {warning}"))?;
    }
    for s in scenarios() {
        let own: Vec<&str> = s.study.theta[diagnosis.severity()..].iter().map(|e| e.name.as_str()).collect();
        let starts = if s.grid.is_empty() { String::new() } else { format!(", from {} starts", s.n_start()) };
        line(format_args!("scenario  {}: {}{starts}", s.name, own.join(", ")))?;
        for warning in &s.study.warnings {
            line(format_args!("warning: scenario `{}`: {warning}", s.name))?;
        }
    }
    Ok(())
}

/// Writes the files of a diagnosis again from its result.
pub(crate) fn write_again(folder: &Path, overview: bool, json: bool) -> Result<(), Failure> {
    if overview {
        return Err(Failure::input("a diagnosis has no overview picture: leave out --overview"));
    }
    let path = folder.join(RESULT);
    let unreadable =
        |error: &dyn std::fmt::Display| Failure::input(format!("cannot read {}: {error}", path.display()));
    let text = std::fs::read_to_string(&path).map_err(|error| unreadable(&error))?;
    let found: Diagnosed = serde_json::from_str(&text).map_err(|error| unreadable(&error))?;
    write_diagnosis(folder, &found).map_err(Failure::run)?;
    tell(&found, folder, json)
}

fn tell(found: &Diagnosed, folder: &Path, json: bool) -> Result<(), Failure> {
    if json {
        return line(serde_json::to_string_pretty(found).map_err(Failure::run)?);
    }
    print::print(found, folder)
}

fn failed(error: &DiagnoseError) -> Failure {
    if error.is_cancelled() {
        return interrupt::failure("nothing is kept of it: start again");
    }
    if error.is_input() { Failure::input(error) } else { Failure::run(error) }
}
