//! `starlings conformance`: try a solver out before a study relies on it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Parser;
use starlings_coordinator::study::posterior;
use starlings_models::{Signal, SolverDef};
use starlings_solver::conformance::{Conformance, Trial, conformance};

use crate::console::{line, text};
use crate::failure::Failure;
use crate::load;
use crate::solvers::{adapter_names, solvers};

/// Try a solver out: restart, determinism, refusals, cancellation, observers. Exit code 1 when a check fails.
#[derive(Parser)]
pub(crate) struct Args {
    /// A study whose solver is tried, as the study starts it, with its prior medians, times and inputs: of a solver of files the only way.
    #[arg(conflicts_with_all = ["solver", "address", "adapter", "ranks"])]
    study: Option<PathBuf>,
    /// The command that starts the solver, as a shell would take it apart.
    #[arg(long, value_name = "CMD", required_unless_present_any = ["address", "study"])]
    solver: Option<String>,
    /// Where a solver listens that is running already.
    #[arg(long, value_name = "ADDR")]
    address: Option<String>,
    /// How the solver is reached.
    #[arg(long, default_value = "grpc", value_name = "NAME", value_parser = adapter_names())]
    adapter: String,
    /// Value of a parameter, or of an input, which is then constant; defaults and middles of ranges without it.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = pair)]
    set: Vec<(String, f64)>,
    /// Times of the trial: START:STEP:END, in the solver's time unit; 0:0.1:2 without a study, whose first record has its own.
    #[arg(long, value_name = "START:STEP:END", value_parser = span)]
    times: Option<Span>,
    /// Seconds that a run may take; 60 without a study.
    #[arg(long, value_name = "SECONDS")]
    timeout: Option<f64>,
    /// Ranks of an MPI solver.
    #[arg(long, default_value_t = 1, value_name = "N")]
    ranks: usize,
    /// Print what was found as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Times of a trial.
#[derive(Clone, Debug)]
pub(crate) struct Span(pub(crate) Vec<f64>);

/// A solver and what it is tried with.
struct Subject {
    def: SolverDef,
    /// Values by name; those of `--set` go before them.
    values: BTreeMap<String, f64>,
    times: Vec<f64>,
    /// Inputs that are no constants, in the order of the description.
    inputs: Option<Vec<Signal>>,
}

/// Tries the solver out.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let subject = match &args.study {
        Some(study) => of_study(args, study)?,
        None => of_command(args)?,
    };
    let Subject { def, mut values, times, inputs } = subject;
    values.extend(args.set.iter().cloned());
    let trial = |description: &_| {
        let mut trial = Trial::of(description, &values, &times)?;
        if let Some(inputs) = inputs.filter(|inputs| inputs.len() == trial.window.inputs.len()) {
            trial.window.inputs = inputs;
        }
        Ok(trial)
    };
    let found = conformance(&solvers()?, &def, trial).map_err(Failure::input)?;
    if args.json {
        line(format_args!("{:#}", serde_json::to_value(&found).map_err(Failure::run)?))?;
    } else {
        print(&found)?;
    }
    match found.failed.len() {
        0 => Ok(()),
        n => Err(Failure::Answered(format!("{n} of {} checks do not hold", n + found.passed.len()))),
    }
}

/// The solver that the command line names.
fn of_command(args: &Args) -> Result<Subject, Failure> {
    if args.adapter == "command" {
        let message = "a solver of files is told by a study which files it reads and writes: `starlings conformance study.toml`";
        return Err(Failure::input(message));
    }
    let command = args.solver.as_deref().map(shell_words::split).transpose().map_err(Failure::input)?;
    let folder = std::env::current_dir().map_err(Failure::run)?;
    let def = SolverDef {
        adapter: args.adapter.clone(),
        command: command.unwrap_or_default(),
        address: args.address.clone(),
        folder: folder.display().to_string(),
        ranks: args.ranks,
        timeout: args.timeout.unwrap_or(60.0),
        ..SolverDef::default()
    };
    let times =
        args.times.clone().map_or_else(|| (0..=20).map(|k| 0.1 * f64::from(k)).collect(), |times| times.0);
    Ok(Subject { def, values: BTreeMap::new(), times, inputs: None })
}

/// The solver of a study, with its prior medians, and times and inputs of its first record.
fn of_study(args: &Args, path: &Path) -> Result<Subject, Failure> {
    let study = load::load(path)?;
    let (Some(def), Some(record)) = (study.setup.model.solver.as_deref().cloned(), study.records.first())
    else {
        return Err(Failure::input(format!(
            "{}: the model of this study runs in no program of its own: nothing has to be tried",
            path.display()
        )));
    };
    load::end_solvers();
    let known = |name: &str| study.spec.parameters.iter().any(|q| q.name == name);
    let priors = posterior::estimates(&study, &posterior::prior(&study));
    let medians = priors.into_iter().map(|e| (e.name, e.prior_median));
    let constants = study.setup.model.constants.iter().map(|(name, value)| (name.clone(), *value));
    Ok(Subject {
        def: SolverDef { timeout: args.timeout.unwrap_or(def.timeout), ..def },
        values: constants.chain(medians).filter(|(name, _)| known(name)).collect(),
        times: args.times.clone().map_or_else(|| record.times.clone(), |times| times.0),
        inputs: Some(record.inputs.clone()),
    })
}

fn print(found: &Conformance) -> Result<(), Failure> {
    let passed = found.passed.iter().map(|name| format!("holds    {name}\n"));
    let skipped = found.skipped.iter().map(|c| format!("-        {}: {}\n", c.name, c.reason));
    let failed = found.failed.iter().map(|c| format!("FAILS    {}: {}\n", c.name, c.reason));
    text(passed.chain(skipped).chain(failed).collect::<String>())
}

fn pair(argument: &str) -> Result<(String, f64), String> {
    let (name, value) = argument.split_once('=').ok_or("expected NAME=VALUE")?;
    Ok((name.trim().to_owned(), value.trim().parse().map_err(|_| format!("`{value}` is no number"))?))
}

pub(crate) fn span(argument: &str) -> Result<Span, String> {
    let numbers: Result<Vec<f64>, _> = argument.split(':').map(str::parse).collect();
    let Ok([start, step, end]) = numbers.map(|n| <[f64; 3]>::try_from(n).unwrap_or([f64::NAN; 3])) else {
        return Err("expected START:STEP:END".to_owned());
    };
    let n = ((end - start) / step + 1e-9).floor();
    if !(step > 0.0 && (3.0..=1e6).contains(&n)) {
        return Err("expected START:STEP:END with at least three steps".to_owned());
    }
    Ok(Span((0..=n as usize).map(|i| start + step * i as f64).collect()))
}
