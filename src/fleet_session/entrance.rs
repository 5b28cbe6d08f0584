//! What a command takes before it writes anything: its address, and the name of its access file.

use std::net::SocketAddr;
use std::time::Duration;

use starlings_coordinator::fleet::Bound;
use starlings_coordinator::fleet::access::{Access, AccessFault};
use starlings_coordinator::metrics::{Address, Server, Source, routes};
use starlings_traces::Traces;

use super::plan::{AccessPlan, Plan};
use crate::console::note;
use crate::failure::Failure;
use crate::traces::open_traces;

/// What was taken. What is in use by another command leaves nothing behind, and neither does one that ends before it listens.
pub(crate) struct Entrance {
    pub(super) bound: Option<Bound>,
    pub(super) access: Option<Access>,
    pub(super) metrics: Option<Address>,
    pub(super) dashboard: Option<Address>,
    pub(super) traces: Option<Traces>,
}

impl Entrance {
    /// Takes the address and the secrets of the access file. `out` is the run folder, where it was named.
    pub(crate) fn take(plan: &Plan, out: Option<&std::path::Path>) -> Result<Self, Failure> {
        let bound = plan.address.map(Bound::new).transpose().map_err(Failure::run)?;
        let serving = |at: Option<SocketAddr>, what| at.map(|at| Address::take(at, what)).transpose();
        let metrics = serving(plan.metrics, "metrics").map_err(Failure::run)?;
        let dashboard = serving(plan.dashboard, "the live page").map_err(Failure::run)?;
        let traces = plan.traces.as_ref().map(|target| open_traces(target, "coordinator")).transpose()?;
        let file = match &plan.access {
            None => return Ok(Self { bound, access: None, metrics, dashboard, traces }),
            Some(AccessPlan::Named(file)) => Some(file.as_path()),
            Some(AccessPlan::RunFolder(file)) => file.as_deref(),
        };
        let mut access = Access::at(file).map_err(|fault| failed(&fault))?;
        // The run folder is made later.
        if let Some(AccessPlan::Named(file)) = &plan.access
            && !out.is_some_and(|out| file.starts_with(out))
        {
            access.reserve(file).map_err(|fault| failed(&fault))?;
        }
        Ok(Self { bound, access: Some(access), metrics, dashboard, traces })
    }
}

/// Serves metrics where an address was taken for them, and says where that is.
pub(super) fn serve_metrics(at: Address, source: Source) -> Result<Server, Failure> {
    let address = at.address;
    let server = Server::start(at, routes(source), Duration::ZERO).map_err(Failure::run)?;
    note(format_args!("metrics at http://{address}/metrics"));
    if !address.ip().is_loopback() {
        note(format_args!(
            "warning: --metrics: whoever reaches {address} can read how many runs are made, by how many workers, and how they end"
        ));
    }
    Ok(server)
}

pub(super) fn failed(fault: &AccessFault) -> Failure {
    if fault.is_input() { Failure::input(format!("--access: {fault}")) } else { Failure::run(fault) }
}
