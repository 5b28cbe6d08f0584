//! `starlings conformance`: try a solver out before a study relies on it.

use std::collections::BTreeMap;

use clap::Parser;
use starlings_models::SolverDef;
use starlings_solver::conformance::{Conformance, Trial, conformance};

use crate::console::{line, text};
use crate::failure::Failure;
use crate::solvers::{adapter_names, solvers};

/// Try a solver out: restart, determinism, refusals, cancellation, observers. Exit code 1 when a check fails.
#[derive(Parser)]
pub(crate) struct Args {
    /// The command that starts the solver, as a shell would take it apart.
    #[arg(long, value_name = "CMD", required_unless_present = "address")]
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
    /// Times of the trial: START:STEP:END, in the solver's time unit.
    #[arg(long, default_value = "0:0.1:2", value_name = "START:STEP:END", value_parser = span)]
    times: Span,
    /// Seconds that a run may take.
    #[arg(long, default_value_t = 60.0, value_name = "SECONDS")]
    timeout: f64,
    /// Ranks of an MPI solver.
    #[arg(long, default_value_t = 1, value_name = "N")]
    ranks: usize,
    /// Print what was found as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Times of a trial.
#[derive(Clone, Debug)]
struct Span(Vec<f64>);

/// Tries the solver out.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let command = args.solver.as_deref().map(shell_words::split).transpose().map_err(Failure::input)?;
    let folder = std::env::current_dir().map_err(Failure::run)?;
    let def = SolverDef {
        adapter: args.adapter.clone(),
        command: command.unwrap_or_default(),
        address: args.address.clone(),
        folder: folder.display().to_string(),
        ranks: args.ranks,
        timeout: args.timeout,
        ..SolverDef::default()
    };
    let given: BTreeMap<String, f64> = args.set.iter().cloned().collect();
    let trial = |description: &_| Trial::of(description, &given, &args.times.0);
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

fn span(argument: &str) -> Result<Span, String> {
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
