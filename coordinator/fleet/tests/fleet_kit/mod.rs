//! What the fleet's tests share: toy models, workers on threads, a proxy whose connections can be cut.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, clippy::missing_panics_doc)]

pub mod access;
pub mod hand;
pub mod inherited;
pub mod large;
#[cfg(target_os = "linux")]
pub mod lent;
pub mod shared;

use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use starlings_fleet::{FleetConfig, FleetEvent, GrpcFleet, Outcome, RunIdentity};
use starlings_models::{Forward, Job, ParticleError, Prediction, Setup, SetupError, Spec, Window};
use starlings_worker::{Factory, WorkerConfig, WorkerError, WorkerReport};
use tokio_util::sync::CancellationToken;

pub type Run = Result<Prediction, ParticleError>;

/// A forward model that is one closure.
pub struct Toy<F> {
    spec: Spec,
    run: F,
}

impl<F: Fn(&Job) -> Run + Send + Sync> Forward for Toy<F> {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn run(&self, job: &Job) -> Run {
        (self.run)(job)
    }
}

/// A factory whose every setup runs this closure.
pub fn factory(run: impl Fn(&Job) -> Run + Send + Sync + Clone + 'static) -> Factory {
    Arc::new(move |_: &Setup| -> Result<Box<dyn Forward>, SetupError> {
        let spec = Spec {
            kind: "toy".to_owned(),
            says: String::new(),
            states: vec![],
            parameters: vec![],
            outputs: vec![],
            inputs: vec![],
            measures: vec![],
            restart: true,
        };
        Ok(Box::new(Toy { spec, run: run.clone() }))
    })
}

/// The toy's exact answer, with rounding, so that equality means the same bits.
pub fn square(job: &Job) -> Prediction {
    let outputs = job.theta.iter().map(|x| x * x + f64::from(job.particle) / 3.0).collect();
    Prediction { outputs, state: job.state.clone().unwrap_or_default(), cost: 0.0 }
}

pub fn jobs(n: u32) -> Vec<Job> {
    let window = Arc::new(Window::free(0.0, vec![1.0], 2, vec![]));
    let job = |particle| Job {
        particle,
        record: 0,
        window: Arc::clone(&window),
        theta: vec![0.1 * f64::from(particle), 0.7],
        state: Some(vec![f64::from(particle)].into()),
    };
    (0..n).map(job).collect()
}

/// Asserts that each outcome is the exact answer to the job of its place.
pub fn assert_exact(outcomes: &[Outcome], jobs: &[Job]) {
    assert_eq!(outcomes.len(), jobs.len());
    for (outcome, job) in outcomes.iter().zip(jobs) {
        let got = outcome.result.as_ref().expect("the toy does not fail");
        let expected = square(job);
        assert_eq!((&got.outputs, &got.state), (&expected.outputs, &expected.state));
    }
}

pub fn any_port() -> SocketAddr {
    (Ipv4Addr::LOCALHOST, 0).into()
}

/// A fleet with short patience, its events and its cancellation.
pub fn listen(address: SocketAddr) -> (GrpcFleet, Receiver<FleetEvent>, CancellationToken) {
    start(Some(address), |_| {})
}

/// The same with a configuration of its own.
pub fn listen_with(
    address: SocketAddr,
    change: impl FnOnce(&mut FleetConfig),
) -> (GrpcFleet, Receiver<FleetEvent>, CancellationToken) {
    start(Some(address), change)
}

/// The same for processes of this one alone.
pub fn private() -> (GrpcFleet, Receiver<FleetEvent>, CancellationToken) {
    start(None, |_| {})
}

/// The same with a configuration of its own.
pub fn private_with(
    change: impl FnOnce(&mut FleetConfig),
) -> (GrpcFleet, Receiver<FleetEvent>, CancellationToken) {
    start(None, change)
}

/// A fleet of this start of a run.
pub fn incarnation(id: u8, incarnation: u64) -> (GrpcFleet, Receiver<FleetEvent>) {
    let (sender, events) = mpsc::channel();
    let mut config = FleetConfig::new(any_port(), "test", CancellationToken::new(), sender);
    config.identity = RunIdentity { id: [id; 16], incarnation };
    (GrpcFleet::listen(config).expect("a free port"), events)
}

fn start(
    address: Option<SocketAddr>,
    change: impl FnOnce(&mut FleetConfig),
) -> (GrpcFleet, Receiver<FleetEvent>, CancellationToken) {
    let (sender, events) = mpsc::channel();
    let cancel = CancellationToken::new();
    let mut config = FleetConfig::new(address, "test", cancel.clone(), sender);
    config.patience = Duration::from_secs(60);
    change(&mut config);
    (GrpcFleet::listen(config).expect("a free port"), events, cancel)
}

/// Waits for the first event that fits.
pub fn await_event(events: &Receiver<FleetEvent>, fits: impl Fn(&FleetEvent) -> bool) -> FleetEvent {
    loop {
        let event = events.recv_timeout(Duration::from_secs(60)).expect("the event comes within a minute");
        if fits(&event) {
            return event;
        }
    }
}

pub fn await_workers(events: &Receiver<FleetEvent>, n: usize) {
    for _ in 0..n {
        await_event(events, |event| matches!(event, FleetEvent::WorkerJoined { .. }));
    }
}

/// A worker on a thread of this process.
pub struct ThreadWorker {
    pub cancel: CancellationToken,
    thread: JoinHandle<Result<WorkerReport, WorkerError>>,
}

impl ThreadWorker {
    pub fn start(address: SocketAddr, factory: Factory) -> Self {
        Self::start_with(address, factory, |_| {})
    }

    pub fn start_with(address: SocketAddr, factory: Factory, change: impl FnOnce(&mut WorkerConfig)) -> Self {
        let mut config = WorkerConfig::new(address.to_string());
        config.factory = factory;
        change(&mut config);
        let cancel = config.cancel.clone();
        Self { cancel, thread: std::thread::spawn(move || starlings_worker::run(config)) }
    }

    pub fn end(self) -> Result<WorkerReport, WorkerError> {
        self.thread.join().expect("a worker does not panic")
    }
}

/// A way to a server that can be cut like a cable; afterwards it passes new connections again.
pub struct Proxy {
    pub address: SocketAddr,
    server: Arc<Mutex<SocketAddr>>,
    ends: Arc<Mutex<Vec<TcpStream>>>,
    silent: Arc<Silent>,
    mute: Arc<Silent>,
}

/// Whether what the server says is held back.
#[derive(Default)]
struct Silent {
    held: Mutex<bool>,
    changed: Condvar,
}

impl Silent {
    fn hold(&self, held: bool) {
        *self.held.lock().unwrap() = held;
        self.changed.notify_all();
    }

    fn wait(&self) {
        let held = self.held.lock().unwrap();
        drop(self.changed.wait_while(held, |held| *held).unwrap());
    }
}

impl Proxy {
    pub fn to(server: SocketAddr) -> Self {
        let listener = TcpListener::bind(any_port()).expect("a free port");
        let address = listener.local_addr().expect("bound");
        let server = Arc::new(Mutex::new(server));
        let way = Arc::clone(&server);
        let ends = Arc::new(Mutex::new(vec![]));
        let shared = Arc::clone(&ends);
        let silent = Arc::<Silent>::default();
        let quiet = Arc::clone(&silent);
        let mute = Arc::<Silent>::default();
        let muted = Arc::clone(&mute);
        std::thread::spawn(move || {
            for near in listener.incoming().map_while(Result::ok) {
                let server = *way.lock().unwrap();
                let Ok(far) = TcpStream::connect(server) else { continue };
                shared.lock().unwrap().extend([near.try_clone().unwrap(), far.try_clone().unwrap()]);
                let (near2, far2) = (near.try_clone().unwrap(), far.try_clone().unwrap());
                let (quiet, muted) = (Arc::clone(&quiet), Arc::clone(&muted));
                std::thread::spawn(move || pump(near, far, || muted.wait()));
                std::thread::spawn(move || pump(far2, near2, || quiet.wait()));
            }
        });
        Self { address, server, ends, silent, mute }
    }

    /// Holds back what the server says, or lets it go; the other direction passes.
    pub fn silence(&self, held: bool) {
        self.silent.hold(held);
    }

    /// Holds back what the clients say.
    pub fn mute(&self) {
        self.mute.hold(true);
    }

    /// Lets go what the clients say.
    pub fn unmute(&self) {
        self.mute.hold(false);
    }

    /// Cuts it, and passes new connections to another server.
    pub fn lead_to(&self, server: SocketAddr) {
        *self.server.lock().unwrap() = server;
        self.cut();
    }

    pub fn cut(&self) {
        for end in self.ends.lock().unwrap().drain(..) {
            let _ = end.shutdown(Shutdown::Both);
        }
    }
}

fn pump(mut from: TcpStream, mut to: TcpStream, gate: impl Fn()) {
    let mut buffer = [0; 16 * 1024];
    while let Ok(n @ 1..) = from.read(&mut buffer) {
        gate();
        if to.write_all(&buffer[..n]).is_err() {
            break;
        }
    }
    let _ = to.shutdown(Shutdown::Both);
    let _ = from.shutdown(Shutdown::Both);
}
