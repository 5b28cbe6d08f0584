//! The fleet of a command: where to listen, how many workers to start, and the way of its events.
//!
//! Shared by every command that runs the model on the fleet. Next file to read: [`crate::run`].

use std::net::{SocketAddr, ToSocketAddrs};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use clap::Args;
use starlings_coordinator::fleet::{
    Bound, FleetConfig, FleetError, FleetEvent, GrpcFleet, LocalConfig, LocalWorkers, RunIdentity,
};
use starlings_coordinator::study::Study;
use starlings_coordinator::study::store::Store;
use starlings_coordinator::study::trial::{FleetTrialError, trial_on_fleet};
use starlings_estimators::Kind;
use tokio_util::sync::CancellationToken;

use crate::console::note;
use crate::failure::Failure;
use crate::interrupt;
use crate::load::end_solvers;
use crate::progress::Display;
use crate::solvers::own_program;

/// Which workers run the model.
#[derive(Args)]
pub(crate) struct FleetArgs {
    /// Number of local worker processes; what the study says (fleet.workers) without it.
    #[arg(long, value_name = "N", conflicts_with = "listen")]
    workers: Option<usize>,
    /// Wait for workers to dial this address (HOST:PORT, port 0 picks a free one) instead of starting local ones.
    #[arg(long, value_name = "ADDR")]
    listen: Option<String>,
    /// Allow --listen beyond loopback although the connection is neither encrypted nor authenticated.
    #[arg(long)]
    insecure: bool,
}

/// What was asked for, checked.
pub(crate) struct Plan {
    /// Where to listen; `None` for local workers, which have their connections from this process.
    address: Option<SocketAddr>,
    /// Workers to start where it does not listen.
    n_worker: usize,
}

impl Plan {
    /// Takes the address, before anything is written: a port in use must leave nothing behind.
    pub(crate) fn bind(&self) -> Result<Option<Bound>, Failure> {
        self.address.map(Bound::new).transpose().map_err(Failure::run)
    }
}

impl FleetArgs {
    /// Whether runs are made on this machine, by workers that this process starts.
    pub(crate) fn is_here(&self) -> bool {
        self.listen.is_none()
    }

    /// Checks the arguments; nothing is started yet.
    pub(crate) fn plan(&self, study: &Study) -> Result<Plan, Failure> {
        let n_worker = self.workers.unwrap_or(study.fleet.workers);
        if n_worker == 0 {
            return Err(Failure::input(
                "--workers must be at least 1 (or use --listen ADDR and start workers elsewhere)",
            ));
        }
        let address = self.listen.as_deref().map(|text| self.address(text)).transpose()?;
        Ok(Plan { address, n_worker })
    }

    /// Where to listen, as it was asked for.
    fn address(&self, text: &str) -> Result<SocketAddr, Failure> {
        let address = text.to_socket_addrs().ok().and_then(|mut all| all.next()).ok_or_else(|| {
            Failure::input(format!("--listen {text}: expected HOST:PORT, such as 127.0.0.1:7000"))
        })?;
        if !address.ip().is_loopback() && !self.insecure {
            return Err(Failure::input(format!(
                "{address} is reachable from other machines, and the connection is neither encrypted nor authenticated in \
                 this version: listen on 127.0.0.1, or accept it with --insecure on a network you trust"
            )));
        }
        Ok(address)
    }
}

/// The fleet of one run, its local workers, and the way of its events to the store.
pub(crate) struct FleetSession {
    pub(crate) fleet: GrpcFleet,
    local: Option<LocalWorkers>,
    /// What happened, for the store.
    pub(crate) events: mpsc::Receiver<FleetEvent>,
    watcher: std::thread::JoinHandle<()>,
}

impl FleetSession {
    /// Listens for workers of this start of a run, where the plan's address was taken; none is started yet.
    pub(crate) fn listen(
        study: &Study,
        bound: Option<Bound>,
        identity: RunIdentity,
        display: &Arc<Display>,
    ) -> Result<Self, Failure> {
        let cancel = CancellationToken::new();
        interrupt::cancels(&cancel);
        let (sender, heard) = mpsc::channel();
        let (kept, events) = mpsc::channel();
        let mut config = FleetConfig::new(None, &study.name, cancel, sender);
        config.identity = identity;
        if let Some(patience) = study.fleet.patience {
            config.patience = Duration::try_from_secs_f64(patience).map_err(Failure::input)?;
        }
        if let Some(attempts) = study.fleet.max_attempts {
            config.max_attempts = attempts;
        }
        let fleet = GrpcFleet::listen_on(bound, config).map_err(Failure::run)?;
        let display = Arc::clone(display);
        let listens = fleet.address().is_some();
        let watcher = std::thread::spawn(move || relay(heard, &kept, &display, listens));
        Ok(Self { fleet, local: None, events, watcher })
    }

    /// Starts the local workers, or says how to start others.
    pub(crate) fn start_workers(&mut self, study: &Study, plan: &Plan) -> Result<(), Failure> {
        if let Some(address) = self.fleet.address() {
            note(format_args!(
                "listening on {address}; start workers with: starlings worker --connect {address}"
            ));
            return Ok(());
        }
        // Their places are the workers'.
        end_solvers();
        let slots = study.fleet.slots.unwrap_or(1).to_string();
        let config = LocalConfig {
            program: own_program().map_err(Failure::run)?,
            args: ["worker", "--slots", &slots].map(str::to_owned).to_vec(),
            n: plan.n_worker,
            fleet: self.fleet.handle(),
        };
        self.local = Some(LocalWorkers::spawn(config).map_err(Failure::run)?);
        Ok(())
    }

    /// Tries a study on workers elsewhere, where it is not tried here.
    pub(crate) fn trial(
        &mut self,
        study: &mut Study,
        kind: Option<&Kind>,
        store: Option<&Store>,
    ) -> Result<(), Failure> {
        trial_on_fleet(study, kind, &mut self.fleet, store).map_err(|error| match error {
            FleetTrialError::Fleet(FleetError::Cancelled) => {
                interrupt::failure("nothing is kept of it: start again")
            }
            FleetTrialError::Trial(error) => Failure::input(error),
            error => Failure::run(error),
        })
    }

    /// Ends the fleet and its workers.
    pub(crate) fn close(self) {
        let Self { fleet, local, watcher, .. } = self;
        fleet.close();
        drop(local);
        // The relay ends with the last sender of events; a panic in it has been printed already.
        let _ = watcher.join();
    }
}

/// Shows the events that people should see at once and hands all of them on to the store. Where workers come from elsewhere, people
/// see who comes and goes.
fn relay(
    heard: mpsc::Receiver<FleetEvent>,
    kept: &mpsc::Sender<FleetEvent>,
    display: &Display,
    listens: bool,
) {
    for event in heard {
        if event.is_notable() || listens && event.is_of_roster() {
            display.say(&event.to_string());
        } else {
            tracing::info!(kind = event.kind(), "{event}");
        }
        if event.is_lasting() {
            // The store stops listening at the end of the run; later events have no reader.
            let _ = kept.send(event);
        }
    }
}
