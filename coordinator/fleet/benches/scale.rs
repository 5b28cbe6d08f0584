//! What a coordinator bears: a thousand connected workers, 16 384 runs in one batch, and how little its workers idle.
//!
//! `cargo bench --workspace --bench scale -- [--workers N] [--points N]`. The workers are those of the program, all in one other process, each over
//! a socket of its own; so the memory and the computing time of this process are the coordinator's alone. Figures of docs/scale.md.
#![allow(clippy::print_stdout, missing_docs)]

use std::net::{Ipv4Addr, SocketAddr};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant};

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use starlings_fleet::{Fleet, FleetConfig, FleetEvent, GrpcFleet, LocalConfig, LocalWorkers, SetupId};
use starlings_models::{
    Forward, Job, ModelDef, ParticleError, Prediction, Setup, SetupError, Spec, StateValues, Window,
};
use starlings_worker::WorkerConfig;
use tokio_util::sync::CancellationToken;

type Failure = Box<dyn std::error::Error>;

/// Values in a prediction and parameters in a job.
const FLOATS: usize = 14;

/// Large batches, one after the other.
const BATCHES: usize = 5;

/// How long idle workers are watched.
const IDLE: Duration = Duration::from_secs(20);

fn main() -> Result<(), Failure> {
    let args = std::env::args().skip(1).collect::<Vec<_>>();
    let after = |flag: &str| args.iter().skip_while(|a| *a != flag).nth(1).cloned();
    let number = |flag: &str, usual: usize| after(flag).map_or(Ok(usual), |text| text.parse());
    // A socket of each worker.
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum })?;
    if let Some(address) = after("--host") {
        return host(&address, number("--workers", 1)?);
    }
    if let Some(address) = after("--connect") {
        return work(&address);
    }
    let (n, points) = (number("--workers", 1000)?, number("--points", 16_384)?);
    many(n, points)?;
    two()
}

/// Many workers and one large batch.
fn many(n: usize, points: usize) -> Result<(), Failure> {
    let before = Usage::now();
    let (sender, events) = mpsc::channel();
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let mut fleet = GrpcFleet::listen(FleetConfig::new(address, "scale", CancellationToken::new(), sender))?;
    let address = fleet.address().ok_or("it listens nowhere")?.to_string();
    let started = Instant::now();
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["--host", &address, "--workers", &n.to_string()]).stdin(Stdio::piped());
    let _host = Host(command.spawn()?);
    let mut joined = 0;
    while joined < n {
        joined = match events.recv_timeout(Duration::from_secs(120)) {
            // Events that come too often are told as a number: the fleet knows how many there are.
            Ok(_) | Err(mpsc::RecvTimeoutError::Timeout) => fleet.n_workers(),
            Err(error) => return Err(error.into()),
        };
        if started.elapsed() > Duration::from_secs(300) {
            return Err(format!("{joined} of {n} workers came").into());
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let wall = started.elapsed().as_secs_f64();
    let connected = Usage::now();
    println!("{n} workers connected in {wall:.1} s");
    let each = (connected.memory_kib - before.memory_kib) as f64 / n as f64;
    println!("  coordinator: {:.0} MiB, {each:.0} KiB a worker", connected.memory_kib as f64 / 1024.0);
    std::thread::sleep(IDLE);
    let idle = (Usage::now().seconds - connected.seconds) / IDLE.as_secs_f64();
    println!("  idle: {:.2} % of a core, {:.2} us a worker and second", 100.0 * idle, 1e6 * idle / n as f64);
    let setup = install(&mut fleet, "noop")?;
    run(&mut fleet, setup, &vec![0.0; n])?;
    // What waits anywhere from batch to batch would be seen in the memory after it.
    for _ in 0..BATCHES {
        let begun = Usage::now();
        let wall = run(&mut fleet, setup, &vec![0.0; points])?.0.as_secs_f64();
        let ended = Usage::now();
        let own = ended.seconds - begun.seconds;
        let (rate, of_core) = (points as f64 / wall, points as f64 / own);
        println!(
            "  {points} no-op runs: {wall:.3} s, {rate:.0} results/s; the coordinator computed {own:.3} s, {of_core:.0} results per second \
             of its core; memory {:.0} MiB, most {:.0} MiB",
            ended.memory_kib as f64 / 1024.0,
            ended.peak_kib as f64 / 1024.0
        );
    }
    fleet.close();
    Ok(())
}

/// Two local workers of one slot: what they idle between runs.
fn two() -> Result<(), Failure> {
    let (sender, events) = mpsc::channel();
    let mut config = FleetConfig::new(None, "scale", CancellationToken::new(), sender);
    // How long a worker idled is another number whenever a run is repeated.
    config.mixed = true;
    let mut fleet = GrpcFleet::listen(config)?;
    let program = std::env::current_exe()?;
    let _workers = LocalWorkers::spawn(LocalConfig { program, args: vec![], n: 2, fleet: fleet.handle() })?;
    for _ in 0..2 {
        while !matches!(events.recv_timeout(Duration::from_secs(30))?, FleetEvent::WorkerJoined { .. }) {}
    }
    let setup = install(&mut fleet, "spin")?;
    // Between 2 and 20 ms, even in the logarithm, in an order that has nothing to do with it.
    let spread =
        (0..1000).map(|i| 0.002 * 10_f64.powf(f64::from(i * 617 % 1000) / 1000.0)).collect::<Vec<_>>();
    println!("2 workers of one slot");
    for (name, seconds) in [("runs of 10 ms", vec![0.01; 1000]), ("runs of 2 to 20 ms", spread)] {
        run(&mut fleet, setup, &seconds[..50])?;
        let (wall, mut gaps) = run(&mut fleet, setup, &seconds)?;
        gaps.sort_unstable_by(f64::total_cmp);
        let efficiency = seconds.iter().sum::<f64>() / 2.0 / wall.as_secs_f64();
        println!(
            "  {name}: {:.1} % efficiency, idle between two runs p50 {:.3} ms, p99 {:.3} ms",
            100.0 * efficiency,
            1e3 * gaps[gaps.len() / 2],
            1e3 * gaps[gaps.len() * 99 / 100]
        );
    }
    fleet.close();
    Ok(())
}

fn install(fleet: &mut GrpcFleet, kind: &str) -> Result<SetupId, Failure> {
    let model = ModelDef { kind: kind.to_owned(), ..ModelDef::default() };
    Ok(fleet.install(&Setup { model, ..Setup::default() })?)
}

/// Wall time of a batch of runs of so many seconds, and how long the workers idled before each.
fn run(fleet: &mut GrpcFleet, setup: SetupId, seconds: &[f64]) -> Result<(Duration, Vec<f64>), Failure> {
    let window =
        Window { start: 0.0, times: vec![1.0], observed: vec![0.0; FLOATS], inputs: vec![], since: vec![] };
    let window = Arc::new(window);
    let job = |(i, seconds): (usize, &f64)| Job {
        particle: i as u32,
        record: 0,
        window: Arc::clone(&window),
        theta: vec![*seconds; FLOATS],
        state: None,
    };
    let jobs = seconds.iter().enumerate().map(job).collect();
    let started = Instant::now();
    let outcomes = fleet.run(setup, jobs)?;
    let wall = started.elapsed();
    let mut gaps = Vec::with_capacity(outcomes.len());
    for (i, outcome) in outcomes.into_iter().enumerate() {
        let prediction = outcome.result?;
        if prediction.outputs[0].to_bits() != (i as f64).to_bits() {
            return Err("an outcome is out of place".into());
        }
        gaps.push(prediction.outputs[1]);
    }
    Ok((wall, gaps))
}

/// When the last run of this process ended.
static ENDED: Mutex<Option<Instant>> = Mutex::new(None);

/// Computes for as long as its parameter says.
struct Bench(Spec);

impl Forward for Bench {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        let started = Instant::now();
        let ended = ENDED.lock().unwrap_or_else(PoisonError::into_inner).take();
        while started.elapsed().as_secs_f64() < job.theta[0] {
            std::hint::spin_loop();
        }
        let mut outputs = job.theta.clone();
        outputs[0] = f64::from(job.particle);
        outputs[1] = match ended {
            Some(ended) if self.0.kind == "spin" => started.duration_since(ended).as_secs_f64(),
            _ => 0.0,
        };
        *ENDED.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
        Ok(Prediction { outputs, state: StateValues::default(), cost: 0.0 })
    }
}

#[expect(clippy::unnecessary_wraps, reason = "as a factory is called")]
fn build(setup: &Setup) -> Result<Box<dyn Forward>, SetupError> {
    Ok(Box::new(Bench(Spec { kind: setup.model.kind.clone(), restart: true, ..Spec::default() })))
}

fn work(address: &str) -> Result<(), Failure> {
    let mut config = WorkerConfig::new(address);
    (config.once, config.factory) = (true, Arc::new(build));
    starlings_worker::run(config)?;
    Ok(())
}

/// So many workers on threads of this process; they end with the coordinator.
fn host(address: &str, n: usize) -> Result<(), Failure> {
    let spawn = |_| {
        let address = address.to_owned();
        let thread = std::thread::Builder::new().stack_size(256 * 1024);
        thread.spawn(move || work(&address).map_err(|error| error.to_string()))
    };
    let threads = (0..n).map(spawn).collect::<Result<Vec<_>, _>>()?;
    for thread in threads {
        // A worker whose coordinator has ended has nothing left to tell.
        let _ = thread.join();
    }
    Ok(())
}

/// Ends the workers with the measurement.
struct Host(Child);

impl Drop for Host {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What this process takes.
struct Usage {
    memory_kib: u64,
    peak_kib: u64,
    /// Computing time, user and system.
    seconds: f64,
}

impl Usage {
    fn now() -> Self {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let of = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|line| line.trim().split(' ').next()?.parse().ok()).unwrap_or(0)
        };
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        let seconds = time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64;
        Self { memory_kib: of("VmRSS:"), peak_kib: of("VmHWM:"), seconds }
    }
}
