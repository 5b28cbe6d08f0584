//! `starlings worker`: dial a coordinator and run its jobs until it says goodbye.

use std::time::Duration;

use clap::Parser;
use starlings_worker::{LIFELINE, MAX_SLOTS, WorkerConfig};
use tokio_util::sync::CancellationToken;

use crate::console::cancel_on_signal;
use crate::failure::Failure;

/// Be a worker: dial the coordinator, run its jobs, hold nothing it needs.
#[derive(Parser)]
pub(crate) struct Args {
    /// Address of the coordinator, HOST:PORT.
    #[arg(long, value_name = "ADDR")]
    connect: String,
    /// Runs at the same time; the number of cores without it.
    #[arg(long, value_name = "N")]
    slots: Option<usize>,
    /// Seconds to keep dialling while nobody answers.
    #[arg(long, default_value_t = 600.0, value_name = "SECONDS", allow_negative_numbers = true)]
    patience: f64,
    /// End when the coordinator's connection closes instead of dialling again.
    #[arg(long)]
    once: bool,
}

/// Works until drained, cancelled or out of patience.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if args.slots.is_some_and(|n| n == 0 || n > MAX_SLOTS) {
        return Err(Failure::input(format!("--slots must be from 1 to {MAX_SLOTS}")));
    }
    let patience = Duration::try_from_secs_f64(args.patience)
        .map_err(|_| Failure::input("--patience must be a number of seconds, zero or more"))?;
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let cancel = CancellationToken::new();
    cancel_on_signal(&cancel);
    let config = WorkerConfig {
        slots: args.slots.unwrap_or(cores),
        once: args.once,
        patience,
        cancel,
        lifeline: std::env::var_os(LIFELINE).is_some(),
        ..WorkerConfig::new(args.connect.clone())
    };
    let report = starlings_worker::run(config).map_err(Failure::run)?;
    tracing::info!(predictions = report.predictions, failures = report.failures, reason = ?report.reason, "done");
    Ok(())
}
