//! What a command is told of its fleet: which workers, where they come from, what is served of it.
//!
//! Next file to read: [`super::plan`], what is made of it before anything is started.

use std::path::{Path, PathBuf};

use clap::Args;
use starlings_coordinator::fleet::PlaceName;
use starlings_coordinator::study::Study;
use starlings_traces::Target;

use super::plan::{ACCESS, AccessPlan, Plan};
use crate::console::note;
use crate::failure::Failure;
use crate::fleet_values::{address, alone, host_of, memory, served_address};
use crate::load::is_outside;

/// Number of local workers where the command line has none.
const WORKERS: &str = "STARLINGS_WORKERS";

/// What `--dashboard` says where there is to be no page.
const OFF: &str = "off";

/// A free port of this machine alone.
const FREE_PORT: &str = "0";

/// Which workers run the model.
#[derive(Args)]
pub(crate) struct FleetArgs {
    /// Number of local worker processes; without it what STARLINGS_WORKERS says, then what the study says (fleet.workers).
    #[arg(long, value_name = "N", conflicts_with = "listen")]
    workers: Option<usize>,
    /// Wait for workers to dial this address (HOST:PORT, port 0 picks a free one) instead of starting local ones.
    #[arg(long, value_name = "ADDR")]
    listen: Option<String>,
    /// With --listen: write what workers need to find and to prove themselves into this file; access.json in the run folder
    /// without it. Where it exists its secrets are used again, so that copies of it stay good over several commands.
    #[arg(long, value_name = "FILE", requires = "listen")]
    access: Option<PathBuf>,
    /// With --listen: take whoever connects, without encryption or proof.
    #[arg(long, requires = "listen", conflicts_with = "access")]
    insecure: bool,
    /// Allow workers whose results differ, as of other builds or processors: a warning of the result instead of an error.
    #[arg(long)]
    mixed: bool,
    /// Memory for states of particles that are larger than 256 KiB, such as "8 GiB"; what is beyond it goes to the disk.
    #[arg(long, value_name = "SIZE", default_value = "1 GiB", value_parser = memory)]
    state_memory: usize,
    /// Folder on a file system that all machines see: states of particles that are larger than 256 KiB stand there, and workers
    /// that name it too read, write and mix them there. With the feature s3 also s3://BUCKET/PREFIX.
    #[arg(long, value_name = "FOLDER", conflicts_with = "state_memory")]
    states: Option<PlaceName>,
    /// Serve what the fleet does in numbers, for Prometheus, at http://ADDR/metrics, and whether it is well at /healthz and /readyz:
    /// PORT or :PORT for this machine alone, HOST:PORT for others too (port 0 picks a free one).
    #[arg(long, value_name = "ADDR")]
    metrics: Option<String>,
    /// Serve a page that follows the command while it runs, with a token in its address: on a free port of this machine alone, or on
    /// PORT, or with HOST:PORT for others too. With --listen there is one on a free port of this machine unless this says `off`.
    #[arg(long, value_name = "ADDR", num_args = 0..=1, require_equals = true, default_missing_value = FREE_PORT)]
    dashboard: Option<String>,
    /// Write a span of this command, of every run and of its computation in a local worker, as OTLP: into a FILE, a line of JSON each,
    /// or to a collector at http://HOST:PORT. Workers elsewhere write theirs where their own --traces says.
    #[arg(long, value_name = "FILE|URL")]
    traces: Option<Target>,
}

impl FleetArgs {
    /// Whether runs are made on this machine, by workers that this process starts.
    pub(crate) fn is_here(&self) -> bool {
        self.listen.is_none()
    }

    /// Whether workers make the trial: nothing of a solver is started where this process listens, and it never holds a large state.
    pub(crate) fn workers_try(&self, study: &Study) -> bool {
        (is_outside(study) && !self.is_here()) || study.has_large_states()
    }

    /// Checks the arguments; nothing is started yet. `out` is the run folder where it is named, `None` for a command that makes
    /// none.
    pub(crate) fn plan(&self, study: &Study, out: Option<&Out<'_>>) -> Result<Plan, Failure> {
        let n_worker = match (self.workers, &self.listen) {
            (Some(n_worker), _) => n_worker,
            (None, None) => of_environment()?.unwrap_or(study.fleet.workers),
            (None, Some(_)) => study.fleet.workers,
        };
        if n_worker == 0 {
            return Err(Failure::input(
                "--workers must be at least 1 (or use --listen ADDR and start workers elsewhere)",
            ));
        }
        let address = self.listen.as_deref().map(|text| address("--listen", text)).transpose()?;
        let serving = |option, text: Option<&str>| text.map(|text| served_address(option, text)).transpose();
        let metrics = serving("--metrics", self.metrics.as_deref())?;
        let page = match (self.dashboard.as_deref(), &self.listen) {
            (Some(OFF), _) | (None, None) => None,
            (Some(place), _) => Some(place),
            (None, Some(_)) => Some(FREE_PORT),
        };
        let dashboard = serving("--dashboard", page)?;
        let host = self.listen.as_deref().and_then(host_of).map(str::to_owned);
        if let (Some(host), Some(address)) = (&host, address)
            && let Some(warning) = alone(host, address)
        {
            note(format_args!("warning: --listen: {warning}"));
        }
        let access = match (address, self.insecure) {
            (Some(_), false) => Some(self.access_plan(out)?),
            _ => None,
        };
        let (mixed, state_memory, states) = (self.mixed, self.state_memory, self.states.clone());
        let traces = self.traces.clone();
        Ok(Plan {
            address,
            host,
            access,
            metrics,
            dashboard,
            traces,
            n_worker,
            mixed,
            state_memory,
            states,
            keeps_states: false,
        })
    }

    fn access_plan(&self, out: Option<&Out<'_>>) -> Result<AccessPlan, Failure> {
        match (&self.access, out) {
            (Some(file), _) => Ok(AccessPlan::Named(file.clone())),
            (None, Some(Out(folder))) => Ok(AccessPlan::RunFolder(folder.map(|folder| folder.join(ACCESS)))),
            (None, None) => Err(Failure::input(
                "this command makes no run folder: say with --access FILE where the access file goes by which workers prove \
                 themselves",
            )),
        }
    }
}

/// How many workers the environment asks for, on a machine whose users should not have to know.
fn of_environment() -> Result<Option<usize>, Failure> {
    let Some(value) = std::env::var_os(WORKERS).filter(|value| !value.is_empty()) else { return Ok(None) };
    let text = value.to_string_lossy();
    let number = text.trim().parse().ok().filter(|n| *n > 0);
    number
        .map(Some)
        .ok_or_else(|| Failure::input(format!("{WORKERS} is `{text}`: give a number of workers, at least 1")))
}

/// The run folder of a command, where it was named.
pub(crate) struct Out<'a>(pub(crate) Option<&'a Path>);
