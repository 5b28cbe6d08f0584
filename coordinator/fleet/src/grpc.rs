//! A fleet of worker processes over gRPC: listens, and runs batches for a caller on an ordinary thread.
//!
//! A caller that waits for its batch drives the network; one that thinks for minutes between two batches delays no heartbeat, since a
//! thread keeps it. Next files to read: [`super::hub`], then [`super::network`].

use std::net::SocketAddr;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use starlings_models::{BuildSetup, Job, Setup};
use starlings_proto::driven::Driven;
use starlings_proto::{MAX_MESSAGE, SetupId, encode_setup};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio::sync::oneshot;
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;

use super::bound::Bound;
use super::config::FleetConfig;
use super::dispatcher::{BatchError, Comparing, Event, Likeness, Rules};
use super::door::{Door, Refusals, Refused};
use super::explained::{Listening, explained};
use super::handle::{Adopted, FleetHandle};
use super::hub::{Hub, Reply, SetupShape, Submission};
use super::network::{self, Ways};
use super::probe::probe;
use super::recombination::{Compared, Recombine};
use super::tally::Readings;
use super::travel::submission;
use super::{Arrived, Fleet, FleetError, FleetEvent, Held, Outcome, StateStore, StoredState, TELL_EVERY};

/// How long the caller of a batch that was dropped waits for the network's last words.
const ALIVE_CHECK: Duration = Duration::from_secs(1);

/// How long a run that is continued waits for the workers of its earlier start, which dial every two seconds, before it gives away
/// jobs that they may have done.
const GRACE: Duration = Duration::from_millis(2500);

/// Workers that dial in.
pub struct GrpcFleet {
    pub(super) hub: Arc<Hub>,
    adopted: UnboundedSender<Adopted>,
    batches: UnboundedSender<Submission>,
    stop: CancellationToken,
    pub(super) network: Arc<Driven>,
    keeper: Option<JoinHandle<Result<(), String>>>,
    refusals: Arc<Refusals>,
    listening: Listening,
    pub(super) cancel: CancellationToken,
    /// Whether results of workers are compared.
    pub(super) compares: bool,
    pub(super) compared: Compared,
}

impl GrpcFleet {
    /// Listens and starts the thread that keeps the network.
    ///
    /// # Errors
    /// [`FleetError::Bind`] when the address is taken or does not exist; [`FleetError::Stopped`] when no thread can start.
    pub fn listen(config: FleetConfig) -> Result<Self, FleetError> {
        let bound = config.address.map(Bound::new).transpose()?;
        Self::listen_on(bound, config)
    }

    /// The same on an address that was taken before, if any: the one in `config` is not looked at.
    ///
    /// # Errors
    /// [`FleetError::Stopped`] when no thread can start.
    pub fn listen_on(bound: Option<Bound>, config: FleetConfig) -> Result<Self, FleetError> {
        let address = bound.as_ref().map(|bound| bound.address);
        let rules = Rules {
            heartbeat: config.heartbeat,
            patience: config.patience,
            max_attempts: config.max_attempts,
            comparing: Some(Comparing { seed: config.seed, mixed: config.mixed }),
            timeout_factor: config.timeout_factor,
        };
        let started_again = address.is_some() && config.identity.incarnation > 1;
        let opens = if started_again { GRACE } else { Duration::ZERO };
        let FleetConfig { run_name, build, identity, events, states, traces, .. } = config;
        let probe = probe(&states)?;
        let hub = Arc::new(Hub::new(run_name, build, identity, rules, opens, events, (states, probe)));
        hub.trace(traces);
        let stop = CancellationToken::new();
        let (batches, submitted) = unbounded_channel();
        let (adopted, ends) = unbounded_channel();
        let refusals = {
            // Whoever asks for the refused outlives the fleet, whose events end with it.
            let hub = Arc::downgrade(&hub);
            Refusals::new(move |event| {
                if let Some(hub) = hub.upgrade() {
                    hub.tell(event);
                }
            })
        };
        let door = bound
            .map(|bound| Door::new(bound.listener, config.secrets.as_ref(), Arc::clone(&refusals)))
            .transpose()
            .map_err(FleetError::Secrets)?;
        let ways = Ways { door, adopted: ends };
        let network = Arc::new(Driven::new().map_err(|e| FleetError::Stopped(e.to_string()))?);
        let keeper = {
            let (hub, cancel, stop) = (Arc::clone(&hub), config.cancel.clone(), stop.clone());
            let network = Arc::clone(&network);
            let heartbeat = config.heartbeat;
            std::thread::Builder::new()
                .name("fleet-network".to_owned())
                .spawn(move || network::run(&network, ways, &hub, heartbeat, submitted, (cancel, stop)))
                .map_err(|e| FleetError::Stopped(e.to_string()))?
        };
        if let Some(address) = address {
            hub.tell(FleetEvent::Listening { address });
        }
        Ok(Self {
            hub,
            adopted,
            batches,
            stop,
            network,
            keeper: Some(keeper),
            refusals,
            listening: Listening { address, is_open: config.secrets.is_none(), start: None, refused: None },
            cancel: config.cancel,
            compares: !config.mixed,
            compared: Compared::drawn_by(config.seed),
        })
    }

    /// Where workers can connect, with the port that was picked; `None` where none can.
    pub fn address(&self) -> Option<SocketAddr> {
        self.listening.address
    }

    /// How many callers were refused, and the last of them with the reason; `None` where none was.
    pub fn refused(&self) -> Refused {
        Refused::new(Arc::clone(&self.refusals))
    }

    /// For whoever watches it in numbers.
    pub fn readings(&self) -> Readings {
        Readings::new(Arc::downgrade(&self.hub))
    }

    /// For the supervisor of local workers.
    pub fn handle(&self) -> FleetHandle {
        FleetHandle::new(Arc::clone(&self.hub), self.adopted.clone())
    }

    /// How workers are started, for the error of a wait for them.
    pub fn started_by(&mut self, command: &str) {
        self.listening.start = Some(command.to_owned());
    }

    /// Asks all workers to leave, waits shortly for them, and stops the network. Dropping does the same.
    pub fn close(self) {
        drop(self);
    }

    fn wait(
        &self,
        mut replies: oneshot::Receiver<Reply>,
        arrived: Arrived<'_>,
    ) -> Result<Vec<Outcome<Held>>, FleetError> {
        loop {
            let reply = self.network.wait(async { timeout(TELL_EVERY, &mut replies).await });
            match reply {
                Some(Ok(Ok(reply))) => {
                    return reply.map_err(|error| {
                        let _ = arrived(self.hub.arrived());
                        explained(error, self.listening())
                    });
                }
                Some(Err(_)) if !self.has_ended() => {
                    if arrived(self.hub.arrived()).is_break() {
                        self.hub.handle(Event::Abort(BatchError::Cancelled));
                        return Err(FleetError::Cancelled);
                    }
                }
                Some(_) | None => return Err(self.end_of()),
            }
        }
    }

    /// Why a batch was dropped: by a network that is about to end, and what it says then is the reason.
    fn end_of(&self) -> FleetError {
        let deadline = Instant::now() + ALIVE_CHECK;
        while !self.has_ended() && Instant::now() < deadline {
            std::thread::sleep(ALIVE_CHECK / 1000);
        }
        FleetError::Stopped(self.hub.why_stopped())
    }

    pub(super) fn has_ended(&self) -> bool {
        self.keeper.as_ref().is_none_or(JoinHandle::is_finished)
    }

    fn listening(&self) -> Listening {
        Listening { refused: self.refusals.summary(), ..self.listening.clone() }
    }
}

impl Fleet for GrpcFleet {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        let (id, json) =
            encode_setup(setup).map_err(|e| FleetError::SetupFailed { reason: e.to_string() })?;
        if json.len() + 1024 > MAX_MESSAGE {
            let reason = format!("its text has {} bytes, a message holds {MAX_MESSAGE}", json.len());
            return Err(FleetError::SetupFailed { reason });
        }
        // A state of another length would be noticed only where states are mixed: where the specification is known, so is its
        // length.
        if !self.hub.knows(std::iter::once(&id)) {
            // Sums over rows predict none of them, and their length is known where they are asked for.
            let sums = setup.sums.is_some();
            let spec = || setup.spec().ok().filter(|spec| spec.restart);
            let n_state = if sums { None } else { spec().map(|spec| spec.n_state()) };
            let shape = SetupShape { parameters: setup.parameters.clone(), n_state, sums };
            self.hub.install(id, json, shape, likeness(setup));
        }
        Ok(id)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        let jobs = jobs.into_iter().map(|(setup, job)| (setup, job.map(Held::from)));
        let outcomes = self.run_held(jobs.collect())?;
        outcomes.into_iter().map(|outcome| Ok(outcome.try_map(Held::for_model)?)).collect()
    }

    fn run_held(&mut self, jobs: Vec<(SetupId, Job<Held>)>) -> Result<Vec<Outcome<Held>>, FleetError> {
        self.run_telling(jobs, &mut |_| ControlFlow::Continue(()))
    }

    fn run_telling(
        &mut self,
        jobs: Vec<(SetupId, Job<Held>)>,
        arrived: Arrived<'_>,
    ) -> Result<Vec<Outcome<Held>>, FleetError> {
        if !self.hub.knows(jobs.iter().map(|(setup, _)| setup)) {
            return Err(FleetError::UnknownSetup);
        }
        let (reply, replies) = oneshot::channel();
        self.hub.states().tidy();
        // Here and not under the hub's lock.
        let batch = submission(jobs, self.hub.states(), reply)?;
        self.batches.send(batch).map_err(|_| self.end_of())?;
        self.wait(replies, arrived)
    }

    fn recombine(&mut self, work: &Recombine<'_>) -> Result<Option<Vec<StoredState>>, FleetError> {
        self.mix(work)
    }

    fn states(&self) -> Option<&StateStore> {
        Some(self.hub.states())
    }

    fn n_workers(&self) -> usize {
        self.hub.counts().0
    }

    fn slots(&self) -> usize {
        self.hub.counts().1
    }
}

impl Drop for GrpcFleet {
    fn drop(&mut self) {
        self.stop.cancel();
        self.network.leave();
        if let Some(keeper) = self.keeper.take() {
            match keeper.join() {
                Ok(Ok(())) => {}
                Ok(Err(error)) => tracing::warn!(error, "the fleet's network ended with an error"),
                Err(_) => tracing::error!("the fleet's network thread panicked"),
            }
        }
    }
}

/// How runs of a setup compare: a program outside promises equal bits, or does not.
fn likeness(setup: &Setup) -> Likeness {
    match setup.model.solver.as_deref().map(|solver| solver.described.as_ref()) {
        None => Likeness::Exact,
        Some(Some(described)) if described.deterministic => Likeness::Promised,
        Some(_) => Likeness::None,
    }
}

#[cfg(test)]
mod tests;
