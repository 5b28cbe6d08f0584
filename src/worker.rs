//! `starlings worker`: dial a coordinator and run its jobs until it says goodbye.
//!
//! Next files to read: [`contact`] for whom it works, [`permit`] for what it runs.

mod contact;
mod permit;

use std::sync::Arc;
use std::time::Duration;

use clap::Parser;
use starlings_models::SolverDef;
use starlings_traces::Target;
use starlings_worker::{MAX_SLOTS, PlaceName, Tell, WorkerConfig, WorkerError};
use tokio_util::sync::CancellationToken;

use crate::console::{cancel_on_signal, line, note};
use crate::failure::Failure;
use crate::log;
use crate::solvers::{adapter_names, solvers};
use crate::traces::open_traces;
use contact::ContactArgs;
pub(crate) use contact::duration;
use permit::{PermitArgs, here};

/// Be a worker: dial the coordinator, run its jobs, hold nothing it needs.
///
/// It runs built-in models and equations. Programs that a study names are run only where --solver or --solver-from names them
/// here, or --allow-commands-from-study permits all of them.
#[derive(Parser)]
pub(crate) struct Args {
    #[command(flatten)]
    contact: ContactArgs,
    #[command(flatten)]
    permit: PermitArgs,
    /// Print what the solver says of itself as JSON, for `described` in a study, and do nothing else.
    #[arg(long, requires = "solver", conflicts_with_all = ["connect", "access", "slots", "once"])]
    describe: bool,
    /// How the solver is reached, for --describe.
    #[arg(long, default_value = "grpc", value_name = "NAME", requires = "describe", value_parser = adapter_names())]
    adapter: String,
    /// Runs at the same time; the number of cores without it.
    #[arg(long, value_name = "N")]
    slots: Option<usize>,
    /// Seconds to keep dialling while nobody answers, and to keep the results that a coordinator may lack.
    #[arg(long, default_value_t = 600.0, value_name = "SECONDS", allow_negative_numbers = true)]
    patience: f64,
    /// End when the coordinator's connection closes instead of dialling again.
    #[arg(long)]
    once: bool,
    /// Folder for states of particles as this machine sees it, where the coordinator names the same one with its --states: states
    /// that are larger than 256 KiB are read, written and mixed there. With the feature s3 also s3://BUCKET/PREFIX.
    #[arg(long, value_name = "FOLDER")]
    states: Option<PlaceName>,
    /// Write a span of every run that its coordinator traces, as OTLP: into a FILE, a line of JSON each, or to a collector at
    /// http://HOST:PORT.
    #[arg(long, value_name = "FILE|URL")]
    traces: Option<Target>,
    /// Place among the workers that one coordinator started on this machine, by which their solvers find their cores.
    #[arg(long, default_value_t = 0, value_name = "I", hide = true)]
    place: usize,
}

/// Works until drained, cancelled or out of patience.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if !args.contact.is_given() {
        return describe(&args.adapter, args.permit.command()?.unwrap_or_default());
    }
    if args.slots.is_some_and(|n| n == 0 || n > MAX_SLOTS) {
        return Err(Failure::input(format!("--slots must be from 1 to {MAX_SLOTS}")));
    }
    let patience = Duration::try_from_secs_f64(args.patience)
        .map_err(|_| Failure::input("--patience must be a number of seconds, zero or more"))?;
    let permit = args.permit.permit()?;
    let contact = args.contact.config()?;
    if !args.contact.is_inherited() {
        args.permit.warn();
    }
    // Without it, what leaves the group of a solver outlives it.
    if let Err(error) = starlings_solver::adopt_orphans() {
        tracing::debug!(%error, "orphans are not adopted");
    }
    let traces = args.traces.as_ref().map(|target| open_traces(target, "worker")).transpose()?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let cancel = CancellationToken::new();
    cancel_on_signal(&cancel);
    let slots = args.slots.unwrap_or(cores);
    let solvers = solvers()?.with_cores_after(args.place.saturating_mul(slots)).permitting(permit);
    let tell: Tell = if args.contact.is_inherited() {
        Arc::new(|_| {})
    } else if log::is_json() {
        log::worker(format!("{}/{}", contact.host, std::process::id()))
    } else {
        tell()
    };
    let config = WorkerConfig {
        slots,
        once: args.once,
        patience,
        cancel,
        factory: solvers.factory(),
        tell,
        states: args.states.clone(),
        traces: traces.clone(),
        reading: args.permit.reading(),
        ..contact
    };
    let ended = starlings_worker::run(config);
    if let Some(traces) = traces {
        traces.close();
    }
    let report = ended.map_err(|error| match error {
        WorkerError::BadAddress { .. } => Failure::input(format!("--connect: {error}")),
        WorkerError::Access(_) | WorkerError::Ended { .. } => Failure::input(format!("--access: {error}")),
        _ => Failure::run(error),
    })?;
    tracing::info!(predictions = report.predictions, failures = report.failures, reason = ?report.reason, "done");
    Ok(())
}

/// Lines for whoever watches a worker.
fn tell() -> Tell {
    Arc::new(|news| note(format_args!("{} worker: {news}", jiff::Timestamp::now().strftime("%H:%M:%SZ"))))
}

/// Starts the solver, asks what it is and prints the answer.
fn describe(adapter: &str, command: Vec<String>) -> Result<(), Failure> {
    let def = SolverDef { adapter: adapter.to_owned(), command, folder: here()?, ..SolverDef::default() };
    let description = solvers()?.describe(&def).map_err(Failure::input)?;
    line(serde_json::to_string_pretty(&description).map_err(Failure::run)?)
}
