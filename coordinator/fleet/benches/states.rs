//! What a large state costs: the states of all particles to two real worker processes and back, beside the raw socket.
//!
//! `cargo bench -p starlings-fleet --bench states -- [--quick] [--local] [--large] [--shared]`. The program starts itself as worker and as the echo that is
//! the limit of the same run. The model hands its state on, so that all of a cycle is transport: from the store through the
//! network to the model and back into the store.
#![allow(clippy::print_stdout, missing_docs)]

#[path = "states/dialled.rs"]
mod dialled;
#[path = "states/raw.rs"]
mod raw;
#[path = "states/shared.rs"]
mod shared;

use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use starlings_fleet::{
    Fleet, FleetConfig, FleetEvent, GrpcFleet, Held, LocalConfig, LocalWorkers, SetupId, StateStore,
    StoredState,
};
use starlings_models::{Forward, Job, ParticleError, Prediction, Setup, SetupError, Spec, Window};
use starlings_proto::StateId;
use starlings_worker::WorkerConfig;
use tokio_util::sync::CancellationToken;

type Failure = Box<dyn std::error::Error>;

/// Particles of one cycle.
const PARTICLES: usize = 22;

/// Values of a state of 8 MB.
const VALUES: usize = 1_000_000;

/// Values of a state of 256 MB.
const LARGE: usize = 32_000_000;

/// Memory for states of 256 MB each.
const LARGE_MEMORY: usize = 256_000_000;

const WORKERS: usize = 2;

/// Bytes of a piece.
const BLOCK: usize = 256 * 1024;

fn main() -> Result<(), Failure> {
    let args = std::env::args().skip(1).collect::<Vec<_>>();
    let has = |flag: &str| args.iter().any(|a| a == flag);
    if has(raw::ECHO) {
        return raw::echo();
    }
    let named = |flag: &str| args.iter().skip_while(|arg| *arg != flag).nth(1);
    if has("--connect") || has("--access") {
        let mut config = WorkerConfig::new(named("--connect").cloned().unwrap_or_default());
        config.access = named("--access").map(Into::into);
        config.once = true;
        config.factory = Arc::new(build);
        config.states = shared::place(&args)?;
        starlings_worker::run(config)?;
        return Ok(());
    }
    let cycles = if has("--quick") { 3 } else { 15 };
    if has("--shared") {
        return shared::bench(cycles, has("--large"));
    }
    if has("--large") {
        // First: the memory that is told is the most of all times.
        large()?;
    }
    pieces();
    travelling(cycles, !has("--local"))
}

/// Four states of 256 MB with memory for one: run, mixed here, run again.
fn large() -> Result<(), Failure> {
    let store = StateStore::new(LARGE_MEMORY);
    let (mut fleet, workers) = fleet(&store, None)?;
    let setup = fleet.install(&Setup::default())?;
    let first = (0..4).map(|k| start(&store, LARGE, k)).collect::<Result<Vec<_>, Failure>>()?;
    let t = nalgebra::DMatrix::from_fn(4, 4, |i, j| if i == j { 0.5 } else { 0.125 });
    let gb = 2.0 * 8.0 * 4.0 * LARGE as f64 / 1e9;
    let started = Instant::now();
    let ended = run(&mut fleet, setup, &first)?;
    let ran = gb / started.elapsed().as_secs_f64();
    drop(first);
    let started = Instant::now();
    let mixed = shared::by_itself(&store, &ended, &t)?;
    let mixing = gb / started.elapsed().as_secs_f64();
    drop(ended);
    let again = run(&mut fleet, setup, &mixed)?;
    if !again.iter().map(StoredState::id).eq(mixed.iter().map(StoredState::id)) {
        return Err("a state is not the one that was sent".into());
    }
    println!("4 states of 256 MB, --state-memory 256 MB: run {ran:.2} GB/s, mixed {mixing:.2} GB/s");
    let most = store.in_memory().1 / 1_000_000;
    println!("  most that the coordinator held: {} MB of its own, {most} MB of states", peak_mb());
    drop(workers);
    fleet.close();
    Ok(())
}

/// All ways, beside the raw sockets.
fn travelling(cycles: usize, dialled: bool) -> Result<(), Failure> {
    let bytes = (2 * 8 * VALUES * PARTICLES) as f64;
    let rate = |wall: Duration| bytes / wall.as_secs_f64() / 1e9;
    let raw = raw::walls(cycles)?;
    println!("{PARTICLES} states of 8 MB there and back, {WORKERS} workers, GB/s both ways");
    println!("  raw socket pairs        p50 {:.2}  best {:.2}", rate(median(&raw)), rate(raw[0]));
    let print = |name: &str, walls: &[Duration]| {
        let (p50, best) = (rate(median(walls)), rate(walls[0]));
        let of_raw = p50 / rate(median(&raw));
        println!("  {name:<22}  p50 {p50:.2}  best {best:.2}  of the socket {of_raw:.2}");
    };
    for (name, memory) in [("local, in memory", usize::MAX), ("local, in a folder", 0)] {
        print(name, &local(memory, cycles)?);
    }
    if dialled {
        let [plain, tls] = dialled::compared(cycles)?;
        print("dialled, in memory", &plain.walls);
        print("TLS, in memory", &tls.walls);
        let bandwidth = 1.0 - median(&plain.walls).as_secs_f64() / median(&tls.walls).as_secs_f64();
        let [busy, busier] = [&plain, &tls].map(|way| 1e3 * way.seconds / cycles as f64);
        println!(
            "  TLS costs {:.0} % of the bandwidth; {:.0} % by processor time, {busier:.0} ms a cycle for {busy:.0}",
            100.0 * bandwidth,
            100.0 * (1.0 - busy / busier)
        );
    }
    Ok(())
}

fn median(sorted: &[Duration]) -> Duration {
    sorted[sorted.len() / 2]
}

/// What happens to every piece on its way, on one thread.
fn pieces() {
    let values: Vec<f64> = (0..VALUES).map(|i| i as f64).collect();
    let best = |work: &mut dyn FnMut()| {
        let mut time = || {
            let started = Instant::now();
            work();
            started.elapsed()
        };
        let fastest = (0..20).map(|_| time()).min().unwrap_or_default();
        8.0 * VALUES as f64 / fastest.as_secs_f64() / 1e9
    };
    let bytes = starlings_proto::convert::floats::encode(&values);
    let hash = best(&mut || {
        for piece in bytes.chunks(BLOCK) {
            std::hint::black_box(starlings_proto::digest(piece));
        }
    });
    let encode = best(&mut || {
        for piece in values.chunks(BLOCK / 8) {
            std::hint::black_box(starlings_proto::convert::floats::encode(piece));
        }
    });
    println!("pieces of 256 KiB on one thread, GB/s: BLAKE3 {hash:.1}, values to bytes {encode:.1}");
}

/// Wall times of cycles with local workers, fastest first.
fn local(memory: usize, cycles: usize) -> Result<Vec<Duration>, Failure> {
    let store = StateStore::new(memory);
    let (fleet, workers) = fleet(&store, None)?;
    let mut there = There::begin(fleet, &store)?;
    let mut walls = Vec::new();
    for cycle in 0..=cycles {
        let wall = there.cycle()?;
        // The first one warms up.
        if cycle > 0 {
            walls.push(wall);
        }
    }
    drop(workers);
    there.end()?;
    walls.sort_unstable();
    Ok(walls)
}

/// A fleet and the states that go there and back.
struct There {
    fleet: GrpcFleet,
    setup: SetupId,
    first: Vec<StateId>,
    now: Vec<StoredState>,
}

impl There {
    fn begin(mut fleet: GrpcFleet, store: &StateStore) -> Result<Self, Failure> {
        let setup = fleet.install(&Setup::default())?;
        let now = (0..PARTICLES).map(|k| start(store, VALUES, k)).collect::<Result<Vec<_>, Failure>>()?;
        let first = now.iter().map(StoredState::id).collect();
        Ok(Self { fleet, setup, first, now })
    }

    /// Wall time of one cycle.
    fn cycle(&mut self) -> Result<Duration, Failure> {
        let started = Instant::now();
        self.now = run(&mut self.fleet, self.setup, &self.now)?;
        Ok(started.elapsed())
    }

    fn end(self) -> Result<(), Failure> {
        if !self.now.iter().map(StoredState::id).eq(self.first) {
            return Err("a state is not the one that was sent".into());
        }
        self.fleet.close();
        Ok(())
    }
}

fn config(store: &StateStore) -> (FleetConfig, mpsc::Receiver<FleetEvent>) {
    let (sender, events) = mpsc::channel();
    let mut config = FleetConfig::new(None, "bench", CancellationToken::new(), sender);
    config.states = store.clone();
    config.identity.id = shared::RUN;
    (config, events)
}

/// A fleet with this store, and its workers; with those that share the place.
fn fleet(store: &StateStore, place: Option<&str>) -> Result<(GrpcFleet, LocalWorkers), Failure> {
    let (config, events) = config(store);
    let fleet = GrpcFleet::listen(config)?;
    let program = std::env::current_exe()?;
    let args = place.map(|place| vec!["--states".to_owned(), place.to_owned()]).unwrap_or_default();
    let workers = LocalWorkers::spawn(LocalConfig { program, args, n: WORKERS, fleet: fleet.handle() })?;
    for _ in 0..WORKERS {
        let is_here = |event: &FleetEvent| match event {
            FleetEvent::SharesStates { .. } => place.is_some(),
            FleetEvent::WorkerJoined { .. } => place.is_none(),
            _ => false,
        };
        while !is_here(&events.recv_timeout(Duration::from_secs(30))?) {}
    }
    Ok((fleet, workers))
}

/// A state piece by piece, so that no more than a piece of it is in memory beside the store.
fn start(store: &StateStore, values: usize, particle: usize) -> Result<StoredState, Failure> {
    let mut writer = store.writer_for_workers(values);
    let mut first = 0;
    while writer.wanted() > 0 {
        let piece: Vec<f64> = (first..first + writer.wanted()).map(|i| (i + particle) as f64).collect();
        first += piece.len();
        writer.push(starlings_proto::convert::floats::encode(&piece))?;
    }
    Ok(writer.finish()?)
}

fn run(fleet: &mut GrpcFleet, setup: SetupId, states: &[StoredState]) -> Result<Vec<StoredState>, Failure> {
    let window =
        Arc::new(Window { start: 0.0, times: vec![1.0], observed: vec![2.0], inputs: vec![], since: vec![] });
    let job = |(k, state): (usize, &StoredState)| {
        let (window, state) = (Arc::clone(&window), Some(Held::Stored(state.clone())));
        (setup, Job { particle: k as u32, record: 0, window, theta: vec![], state })
    };
    let outcomes = fleet.run_held(states.iter().enumerate().map(job).collect())?;
    let state = |outcome: starlings_fleet::Outcome<Held>| match outcome.result?.state {
        Held::Stored(state) => Ok(state),
        Held::Values(_) => Err("a large state came as values".into()),
    };
    outcomes.into_iter().map(state).collect()
}

/// A model that ends where it starts.
struct Still(Spec);

impl Forward for Still {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        Ok(Prediction { outputs: vec![0.0], state: job.state.clone().unwrap_or_default(), cost: 0.0 })
    }
}

#[expect(clippy::unnecessary_wraps, reason = "as a factory is called")]
fn build(_: &Setup) -> Result<Box<dyn Forward>, SetupError> {
    Ok(Box::new(Still(Spec { restart: true, ..Spec::default() })))
}

/// Most memory that this process held, MB.
fn peak_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().split(' ').next()?.parse::<u64>().ok()).map_or(0, |kib| kib / 1000)
}
