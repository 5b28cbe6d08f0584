//! A fleet of this program's own processes on sockets of its own, for the benchmarks that need one.

use std::sync::mpsc::{self, Receiver};

use starlings_coordinator::fleet::{FleetConfig, FleetEvent, GrpcFleet, LocalConfig, LocalWorkers};
use tokio_util::sync::CancellationToken;

use crate::Failure;

/// Starts `n` workers: this program with `--connect stdin`. They end when the second is dropped.
pub(crate) fn start(
    name: &str,
    n: usize,
) -> Result<(GrpcFleet, LocalWorkers, Receiver<FleetEvent>), Failure> {
    let (sender, events) = mpsc::channel();
    let fleet = GrpcFleet::listen(FleetConfig::new(None, name, CancellationToken::new(), sender))?;
    let workers = LocalWorkers::spawn(LocalConfig {
        program: std::env::current_exe()?,
        args: vec![],
        n,
        fleet: fleet.handle(),
    })?;
    Ok((fleet, workers, events))
}
