//! `starlings worker`: dial a coordinator and run its jobs until it says goodbye.

use std::sync::Arc;
use std::time::Duration;

use clap::Parser;
use starlings_models::SolverDef;
use starlings_worker::{INHERITED, MAX_SLOTS, Tell, WorkerConfig, WorkerError};
use tokio_util::sync::CancellationToken;

use crate::console::{cancel_on_signal, line, note};
use crate::failure::Failure;
use crate::solvers::{adapter_names, solvers};

/// Be a worker: dial the coordinator, run its jobs, hold nothing it needs.
#[derive(Parser)]
pub(crate) struct Args {
    /// Address of the coordinator, HOST:PORT.
    #[arg(long, value_name = "ADDR", required_unless_present = "describe")]
    connect: Option<String>,
    /// The command that starts the solver on this machine, as a shell would take it apart; it replaces that of every study.
    #[arg(long, value_name = "CMD")]
    solver: Option<String>,
    /// Print what the solver says of itself as JSON, for `described` in a study, and do nothing else.
    #[arg(long, requires = "solver", conflicts_with_all = ["connect", "slots", "once"])]
    describe: bool,
    /// How the solver is reached, for --describe.
    #[arg(long, default_value = "grpc", value_name = "NAME", requires = "describe", value_parser = adapter_names())]
    adapter: String,
    /// Runs at the same time; the number of cores without it.
    #[arg(long, value_name = "N")]
    slots: Option<usize>,
    /// Seconds to keep dialling while nobody answers.
    #[arg(long, default_value_t = 600.0, value_name = "SECONDS", allow_negative_numbers = true)]
    patience: f64,
    /// End when the coordinator's connection closes instead of dialling again.
    #[arg(long)]
    once: bool,
    /// Place among the workers that one coordinator started on this machine, by which their solvers find their cores.
    #[arg(long, default_value_t = 0, value_name = "I", hide = true)]
    place: usize,
}

/// Works until drained, cancelled or out of patience.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let command = args.solver.as_deref().map(solver_command).transpose()?;
    let Some(connect) = &args.connect else { return describe(&args.adapter, command.unwrap_or_default()) };
    if args.slots.is_some_and(|n| n == 0 || n > MAX_SLOTS) {
        return Err(Failure::input(format!("--slots must be from 1 to {MAX_SLOTS}")));
    }
    let patience = Duration::try_from_secs_f64(args.patience)
        .map_err(|_| Failure::input("--patience must be a number of seconds, zero or more"))?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let cancel = CancellationToken::new();
    cancel_on_signal(&cancel);
    let slots = args.slots.unwrap_or(cores);
    let mut solvers = solvers()?.with_cores_after(args.place.saturating_mul(slots));
    if let Some(command) = command {
        solvers = solvers.with_command(command, here()?);
    }
    let config = WorkerConfig {
        slots,
        once: args.once,
        patience,
        cancel,
        factory: solvers.factory(),
        tell: tell(connect),
        ..WorkerConfig::new(connect.clone())
    };
    let report = starlings_worker::run(config).map_err(|error| match error {
        WorkerError::BadAddress { .. } => Failure::input(format!("--connect: {error}")),
        _ => Failure::run(error),
    })?;
    tracing::info!(predictions = report.predictions, failures = report.failures, reason = ?report.reason, "done");
    Ok(())
}

/// Lines for whoever watches a worker; one that a coordinator of this machine started says nothing.
fn tell(connect: &str) -> Tell {
    if connect == INHERITED {
        return Arc::new(|_| {});
    }
    Arc::new(|news| note(format_args!("{} worker: {news}", jiff::Timestamp::now().strftime("%H:%M:%SZ"))))
}

/// A command line in parts; there must be a program.
fn solver_command(text: &str) -> Result<Vec<String>, Failure> {
    let parts =
        shell_words::split(text).map_err(|error| Failure::input(format!("--solver {text}: {error}")))?;
    if parts.first().is_none_or(String::is_empty) {
        return Err(Failure::input("--solver names no program: such as --solver \"python3 beam.py\""));
    }
    Ok(parts)
}

/// Where names of files in a command line lead.
fn here() -> Result<String, Failure> {
    Ok(std::env::current_dir().map_err(Failure::run)?.display().to_string())
}

/// Starts the solver, asks what it is and prints the answer.
fn describe(adapter: &str, command: Vec<String>) -> Result<(), Failure> {
    let def = SolverDef { adapter: adapter.to_owned(), command, folder: here()?, ..SolverDef::default() };
    let description = solvers()?.describe(&def).map_err(Failure::input)?;
    line(serde_json::to_string_pretty(&description).map_err(Failure::run)?)
}
