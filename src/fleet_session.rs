//! The fleet of a command: where to listen, how many workers to start, and the way of its events.
//!
//! Shared by every command that runs the model on the fleet. Next file to read: [`crate::run`].

mod args;
mod entrance;
mod live_page;
mod load_file;
mod plan;
mod relay;
mod repeated;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Arc, OnceLock, mpsc};
use std::time::Duration;

use starlings_coordinator::fleet::access::Access;
use starlings_coordinator::fleet::{
    FleetConfig, FleetError, FleetEvent, GrpcFleet, LocalConfig, LocalWorkers, RunIdentity,
};
use starlings_coordinator::live::LivePage;
use starlings_coordinator::metrics::{Address, Server, Source};
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
use crate::traces::Traced;
pub(crate) use args::{FleetArgs, Out};
pub(crate) use entrance::Entrance;
use entrance::{failed, serve_metrics};
pub(crate) use live_page::finish;
use live_page::serve_page;
use load_file::LoadFile;
use plan::{ACCESS, AccessPlan, Plan};
use relay::{Shown, relay};

/// The fleet of one run, its local workers, and the way of its events to the store.
pub(crate) struct FleetSession {
    pub(crate) fleet: GrpcFleet,
    local: Option<LocalWorkers>,
    access: Option<Access>,
    /// How much work there is, where that is asked for.
    load: Option<LoadFile>,
    /// How to start workers, once they may come from elsewhere.
    invitation: Arc<OnceLock<String>>,
    /// What happened, for the store.
    pub(crate) events: mpsc::Receiver<FleetEvent>,
    watcher: std::thread::JoinHandle<()>,
    /// What is served of it in numbers.
    source: Source,
    metrics: Option<Server>,
    /// Where the live page will be, until it is.
    dashboard: Option<Address>,
    page: Option<LivePage>,
    traced: Option<Traced>,
}

impl FleetSession {
    /// Listens for workers of this start of a run, where an address was taken; none is started yet.
    pub(crate) fn listen(
        study: &Study,
        plan: &Plan,
        entrance: Entrance,
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
        let Entrance { bound, access, metrics, dashboard, traces } = entrance;
        config.secrets = access.as_ref().map(|access| access.secrets().clone());
        (config.seed, config.mixed) = (study.seed, plan.mixed);
        config.timeout_factor = study.fleet.timeout_factor;
        config.states = plan.store(&config.identity);
        let traced = traces.map(|traces| Traced::begin(traces, &study.name));
        config.traces = traced.as_ref().map(Traced::for_runs);
        let fleet = GrpcFleet::listen_on(bound, config).map_err(Failure::run)?;
        let source = Source::new(fleet.readings(), env!("CARGO_PKG_VERSION"));
        let metrics = metrics.map(|at| serve_metrics(at, source.clone())).transpose()?;
        let refused = fleet.refused();
        let listens = fleet.address().is_some();
        let shown = Shown { display: Arc::clone(display), run: study.name.clone(), listens };
        let invitation = Arc::<OnceLock<String>>::default();
        let told = Arc::clone(&invitation);
        let watcher = std::thread::spawn(move || {
            let missing = || [refused.summary(), told.get().cloned()];
            relay(heard, &kept, &shown, missing);
        });
        let (local, load) = (None, None);
        let page = None;
        Ok(Self {
            fleet,
            local,
            access,
            load,
            invitation,
            events,
            watcher,
            source,
            metrics,
            dashboard,
            page,
            traced,
        })
    }

    /// Serves the live page, where it is asked for; `folder` is that of the run, where it has a store.
    pub(crate) fn show(
        &mut self,
        study: &Study,
        command: &str,
        folder: Option<&Path>,
        display: &Display,
    ) -> Result<(), Failure> {
        let Some(at) = self.dashboard.take() else { return Ok(()) };
        self.page = Some(serve_page(at, (study, command), (self.fleet.readings(), folder), display)?);
        Ok(())
    }

    /// Starts the local workers, or says how to start others; `folder` is the run folder, where there is one.
    pub(crate) fn start_workers(
        &mut self,
        study: &Study,
        plan: &Plan,
        folder: Option<&Path>,
    ) -> Result<(), Failure> {
        if let Some(address) = self.fleet.address() {
            return self.invite(address, &study.name, plan, folder);
        }
        // Their places are the workers'.
        end_solvers();
        let slots = study.fleet.slots.unwrap_or(1).to_string();
        let mut args =
            ["worker", "--allow-commands-from-study", "--slots", &slots].map(str::to_owned).to_vec();
        args.extend(plan.states.iter().flat_map(|place| ["--states".to_owned(), place.to_string()]));
        args.extend(plan.traces.iter().flat_map(|target| ["--traces".to_owned(), target.to_string()]));
        let config = LocalConfig {
            program: own_program().map_err(Failure::run)?,
            args,
            n: plan.n_worker,
            fleet: self.fleet.handle(),
        };
        self.local = Some(LocalWorkers::spawn(config).map_err(Failure::run)?);
        Ok(())
    }

    /// Writes the access file, and says how to start workers.
    fn invite(
        &mut self,
        address: SocketAddr,
        run: &str,
        plan: &Plan,
        folder: Option<&Path>,
    ) -> Result<(), Failure> {
        let file = match &plan.access {
            Some(AccessPlan::Named(file)) => file.clone(),
            Some(AccessPlan::RunFolder(_)) => folder.unwrap_or(Path::new(".")).join(ACCESS),
            None => {
                note(format_args!(
                    "warning: --insecure: nothing is encrypted, and whoever reaches {address} joins this run, reads its data and can \
                     decide its result"
                ));
                let start =
                    format!("starlings worker --connect {address} --insecure{}", plan.states_option());
                self.say_how(address, &start);
                return Ok(());
            }
        };
        if let Some(access) = &mut self.access {
            access.publish(&file, run, address, plan.host.as_deref()).map_err(|fault| failed(&fault))?;
        }
        let absolute = std::path::absolute(&file).unwrap_or(file);
        self.load = LoadFile::beside(&absolute, self.fleet.handle());
        let name = shell_words::quote(&absolute.to_string_lossy()).into_owned();
        self.say_how(address, &format!("starlings worker --access {name}{}", plan.states_option()));
        Ok(())
    }

    fn say_how(&mut self, address: SocketAddr, start: &str) {
        self.fleet.started_by(start);
        let invitation = format!("listening on {address}; start workers with: {start}");
        note(&invitation);
        let _ = self.invitation.set(invitation);
    }

    /// Tries a study on the workers, where it is not tried here.
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

    /// What is told of it in numbers, for what the fleet does not count itself.
    pub(crate) fn source(&self) -> Source {
        self.source.clone()
    }

    /// Ends the fleet and its workers, and says to those whether the command is done. The live page goes on until it is dropped or
    /// [`finish`]ed.
    pub(crate) fn close(self, is_done: bool) -> Option<LivePage> {
        if !is_done {
            self.fleet.handle().break_off();
        }
        let Self { fleet, local, watcher, mut access, load, metrics, page, traced, .. } = self;
        // It has a hold on the fleet, which ends with the last one.
        drop(load);
        // Before the workers leave: one that stays looks there for what comes next.
        if let Some(access) = &mut access {
            access.end();
        }
        fleet.close();
        drop(metrics);
        drop(local);
        // The relay ends with the last sender of events; a panic in it has been printed already.
        let _ = watcher.join();
        if let Some(traced) = traced {
            traced.end();
        }
        page
    }
}
