//! A fleet of worker processes over gRPC: listens, and runs batches for a caller on an ordinary thread.
//!
//! The network lives on a thread of its own, so a caller that thinks for minutes between two batches delays no heartbeat. Next file to
//! read: [`super::hub`], then [`super::network`].

use std::net::SocketAddr;
use std::ops::ControlFlow;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use starlings_models::{BuildSetup, Job, Setup};
use starlings_proto::convert::job::check_size;
use starlings_proto::{JobEncoder, MAX_MESSAGE, SetupId, encode_setup, own_build};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio_util::sync::CancellationToken;

use super::bound::Bound;
use super::dispatcher::{BatchError, Event, Rules};
use super::handle::FleetHandle;
use super::hub::{Hub, Reply, Submission};
use super::identity::RunIdentity;
use super::network::{self, Ways};
use super::{Arrived, Fleet, FleetError, FleetEvent, Outcome, TELL_EVERY};

/// How long the caller of a batch that was dropped waits for the network's last words.
const ALIVE_CHECK: Duration = Duration::from_secs(1);

/// How long a run that is continued waits for the workers of its earlier start, which dial every two seconds, before it gives away
/// jobs that they may have done.
const GRACE: Duration = Duration::from_millis(2500);

/// How a fleet listens and when it loses patience.
#[derive(Clone, Debug)]
pub struct FleetConfig {
    /// Where to listen, port 0 picks a free one; `None`: nowhere, for a fleet of processes that this one starts.
    pub address: Option<SocketAddr>,
    /// Name of the run, told to workers.
    pub run_name: String,
    /// Time between heartbeats; a worker silent for twice as long is lost.
    pub heartbeat: Duration,
    /// How long a batch waits without any usable worker before it is an error.
    pub patience: Duration,
    /// How many workers may be lost under one job before it is given up.
    pub max_attempts: u32,
    /// The run: workers of an earlier start of it bring along what they have done.
    pub identity: RunIdentity,
    /// BLAKE3 of this executable: a worker of another one is told of. `None`: none is.
    pub build: Option<[u8; 32]>,
    /// Ends [`Fleet::run`] promptly with [`FleetError::Cancelled`].
    pub cancel: CancellationToken,
    /// Where events go.
    pub events: Sender<FleetEvent>,
}

impl FleetConfig {
    /// The usual numbers: heartbeat 8 s, patience 5 minutes, five losses per job.
    pub fn new(
        address: impl Into<Option<SocketAddr>>,
        run_name: &str,
        cancel: CancellationToken,
        events: Sender<FleetEvent>,
    ) -> Self {
        Self {
            address: address.into(),
            run_name: run_name.to_owned(),
            heartbeat: Duration::from_secs(8),
            patience: Duration::from_secs(300),
            max_attempts: 5,
            identity: RunIdentity::new(),
            build: own_build(),
            cancel,
            events,
        }
    }
}

/// Workers that dial in.
pub struct GrpcFleet {
    hub: Arc<Hub>,
    address: Option<SocketAddr>,
    adopted: UnboundedSender<UnixStream>,
    batches: UnboundedSender<Submission>,
    stop: CancellationToken,
    network: Option<JoinHandle<Result<(), String>>>,
}

impl GrpcFleet {
    /// Listens and starts the network thread.
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
        };
        let started_again = address.is_some() && config.identity.incarnation > 1;
        let opens = if started_again { GRACE } else { Duration::ZERO };
        let hub = Hub::new(config.run_name, config.build, config.identity, rules, opens, config.events);
        let hub = Arc::new(hub);
        let stop = CancellationToken::new();
        let (batches, submitted) = unbounded_channel();
        let (adopted, ends) = unbounded_channel();
        let ways = Ways { listener: bound.map(|bound| bound.listener), adopted: ends };
        let network = {
            let (hub, cancel, stop) = (Arc::clone(&hub), config.cancel.clone(), stop.clone());
            let heartbeat = config.heartbeat;
            std::thread::Builder::new()
                .name("fleet-network".to_owned())
                .spawn(move || network::run(ways, &hub, heartbeat, submitted, &cancel, &stop))
                .map_err(|e| FleetError::Stopped(e.to_string()))?
        };
        if let Some(address) = address {
            hub.tell(FleetEvent::Listening { address });
        }
        Ok(Self { hub, address, adopted, batches, stop, network: Some(network) })
    }

    /// Where workers can connect, with the port that was picked; `None` where none can.
    pub fn address(&self) -> Option<SocketAddr> {
        self.address
    }

    /// For the supervisor of local workers.
    pub fn handle(&self) -> FleetHandle {
        FleetHandle::new(Arc::clone(&self.hub), self.adopted.clone())
    }

    /// Asks all workers to leave, waits shortly for them, and stops the network. Dropping does the same.
    pub fn close(self) {
        drop(self);
    }

    fn wait(
        &self,
        replies: &mpsc::Receiver<Reply>,
        arrived: Arrived<'_>,
    ) -> Result<Vec<Outcome>, FleetError> {
        loop {
            match replies.recv_timeout(TELL_EVERY) {
                Ok(Ok(outcomes)) => return Ok(outcomes),
                Ok(Err(error)) => {
                    let _ = arrived(self.hub.arrived());
                    return Err(self.explain(error));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    // The batch was dropped by a network that is about to end: what it says then is the reason.
                    let deadline = Instant::now() + ALIVE_CHECK;
                    while !self.has_ended() && Instant::now() < deadline {
                        std::thread::sleep(ALIVE_CHECK / 1000);
                    }
                    return Err(FleetError::Stopped(self.hub.why_stopped()));
                }
                Err(RecvTimeoutError::Timeout) => {
                    if self.has_ended() {
                        return Err(FleetError::Stopped(self.hub.why_stopped()));
                    }
                    if arrived(self.hub.arrived()).is_break() {
                        self.hub.handle(Event::Abort(BatchError::Cancelled));
                        return Err(FleetError::Cancelled);
                    }
                }
            }
        }
    }

    fn has_ended(&self) -> bool {
        self.network.as_ref().is_none_or(JoinHandle::is_finished)
    }

    fn explain(&self, error: BatchError) -> FleetError {
        match error {
            BatchError::Cancelled => FleetError::Cancelled,
            BatchError::NoWorkers { waited, missing } => {
                FleetError::NoWorkers { address: self.address, waited: waited.as_secs_f64(), missing }
            }
            BatchError::SetupFailed { reason } => FleetError::SetupFailed { reason },
            BatchError::LocalWorkers(reason) => FleetError::LocalWorkers(reason),
            BatchError::Stopped(reason) => FleetError::Stopped(reason),
            BatchError::Unavailable { waited, reasons } => {
                FleetError::Unavailable { waited: waited.as_secs_f64(), reasons }
            }
            BatchError::NoControl { particle, record, parameters, reason, .. } => {
                FleetError::NoControl { particle, record, parameters, reason }
            }
            BatchError::NoAnswer { index, particle, record, reason } => {
                FleetError::NoAnswer { job: index, particle, record, reason }
            }
        }
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
            let n_state = setup.spec().ok().filter(|spec| spec.restart).map(|spec| spec.n_state());
            self.hub.install(id, json, setup.parameters.clone(), n_state);
        }
        Ok(id)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        self.run_telling(jobs, &mut |_| ControlFlow::Continue(()))
    }

    fn run_telling(
        &mut self,
        jobs: Vec<(SetupId, Job)>,
        arrived: Arrived<'_>,
    ) -> Result<Vec<Outcome>, FleetError> {
        for (_, job) in &jobs {
            check_size(job).map_err(FleetError::TooLarge)?;
        }
        if !self.hub.knows(jobs.iter().map(|(setup, _)| setup)) {
            return Err(FleetError::UnknownSetup);
        }
        let (reply, replies) = mpsc::channel();
        // Here and not under the hub's lock.
        let encoder = JobEncoder::of(jobs.iter().map(|(_, job)| job));
        let sent = self.batches.send(Submission { jobs, encoder, reply });
        sent.map_err(|_| FleetError::Stopped(self.hub.why_stopped()))?;
        self.wait(&replies, arrived)
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
        if let Some(network) = self.network.take() {
            match network.join() {
                Ok(Ok(())) => {}
                Ok(Err(error)) => tracing::warn!(error, "the fleet's network ended with an error"),
                Err(_) => tracing::error!("the fleet's network thread panicked"),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use starlings_models::Window;

    use super::*;

    #[test]
    fn a_panic_in_the_middle_of_a_decision_ends_the_run_with_an_error() {
        let (sender, _events) = mpsc::channel();
        let config = FleetConfig::new(None, "test", CancellationToken::new(), sender);
        let mut fleet = GrpcFleet::listen(config).expect("a fleet");
        let setup = fleet.install(&Setup::default()).expect("it travels");
        fleet.hub.panic_inside();
        let window = Window { start: 0.0, times: vec![1.0], observed: vec![0.0], inputs: vec![] };
        let job = Job { particle: 0, record: 0, window: window.into(), theta: vec![], state: None };
        let error = fleet.run(setup, vec![job]).expect_err("nothing can be decided any more");
        assert!(matches!(&error, FleetError::Stopped(why) if why.contains("panic")), "{error}");
    }
}
