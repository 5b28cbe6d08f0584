//! What a message costs: the fleet's overhead per cycle and per job over two real worker processes.
//!
//! `cargo bench --bench fleet -- [--json] [--quick]`. The program starts itself as worker and as the plain TCP echo that is
//! the floor of the same run. No statistics framework: a cycle is a barrier over three processes, not a function call.
//! Next files to read: `fleet/screening.rs`, for batches of many setups; `fleet/tls.rs`.
#![allow(clippy::print_stdout, missing_docs)]

#[path = "fleet/local.rs"]
mod local_fleet;
#[path = "fleet/screening.rs"]
mod screening;
#[path = "fleet/tls.rs"]
mod tls;

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::process::{Child, Command};
use std::sync::Arc;
use std::time::{Duration, Instant};

use screening::Screening;
use starlings_coordinator::fleet::{Fleet, FleetEvent, GrpcFleet, SetupId};
use starlings_models::{
    BuildSetup, Forward, Job, ModelDef, ParticleError, Prediction, Setup, SetupError, Spec, Window,
};
use starlings_worker::WorkerConfig;
use tls::Tls;

type Failure = Box<dyn std::error::Error>;

/// Particles of one cycle.
const PARTICLES: usize = 22;

/// Bytes of numbers in a job; a job message has about 200 bytes in all.
const FLOATS: usize = 14;

/// Length of a busy job.
const BUSY: Duration = Duration::from_millis(10);

const WORKERS: usize = 2;

/// Screenings measured; all their setups together fit into a worker's cache.
const SCREENINGS: usize = 10;

fn main() -> Result<(), Failure> {
    let args = std::env::args().skip(1).collect::<Vec<_>>();
    let after = |flag: &str| args.iter().skip_while(|a| *a != flag).nth(1).cloned();
    if let Some(address) = after("--echo") {
        return echo(&address);
    }
    if let Some(address) = after("--connect") {
        return work(WorkerConfig::new(address));
    }
    if let Some(file) = after("--access") {
        let access = Some(file.into());
        return work(WorkerConfig { access, ..WorkerConfig::new(String::new()) });
    }
    let has = |flag: &str| args.iter().any(|a| a == flag);
    let figures = measure(if has("--quick") { 10 } else { 1 })?;
    if has("--json") {
        println!("{}", figures.json());
    } else {
        print!("{}", figures.table());
    }
    Ok(())
}

/// What was measured.
struct Figures {
    cycle_p50_ms: f64,
    cycle_p99_ms: f64,
    bag_jobs_per_s: f64,
    /// Number of jobs × 10 ms over (workers × wall time of the batch).
    efficiency_10ms: f64,
    screening: Screening,
    tls: Tls,
    raw_tcp_cycle_p50_ms: f64,
}

/// Turns of the comparison of TLS with a plain connection.
const TURNS: usize = 20;

impl Figures {
    fn ratio(&self) -> f64 {
        self.cycle_p50_ms / self.raw_tcp_cycle_p50_ms
    }

    fn json(&self) -> String {
        let Self {
            cycle_p50_ms, cycle_p99_ms, bag_jobs_per_s, efficiency_10ms, raw_tcp_cycle_p50_ms, ..
        } = self;
        let Screening { cold, warm, run_ms, build_ms } = &self.screening;
        let ratio = self.ratio();
        let Tls { plain, sealed } = &self.tls;
        let (busy, busy_tls, noop, noop_tls) = (plain.busy_ms, sealed.busy_ms, plain.noop_ms, sealed.noop_ms);
        let cost = self.tls.cost();
        format!(
            "{{\"cycle_p50_ms\":{cycle_p50_ms:.4},\"cycle_p99_ms\":{cycle_p99_ms:.4},\"bag_jobs_per_s\":{bag_jobs_per_s:.0},\
             \"efficiency_10ms\":{efficiency_10ms:.4},\"efficiency_screening_cold\":{cold:.4},\
             \"efficiency_screening_warm\":{warm:.4},\"screening_run_ms\":{run_ms:.3},\
             \"screening_build_ms\":{build_ms:.4},\"cycle_10ms_plain_ms\":{busy:.3},\"cycle_10ms_tls_ms\":{busy_tls:.3},\
             \"cycle_tcp_plain_ms\":{noop:.4},\"cycle_tcp_tls_ms\":{noop_tls:.4},\"tls_cost\":{cost:.4},\
             \"raw_tcp_cycle_p50_ms\":{raw_tcp_cycle_p50_ms:.4},\
             \"ratio\":{ratio:.2},\"workers\":{WORKERS},\"particles\":{PARTICLES}}}"
        )
    }

    fn table(&self) -> String {
        format!(
            "cycle of {PARTICLES} no-op jobs, {WORKERS} workers   p50 {:.3} ms   p99 {:.3} ms\n\
             the same bytes over plain TCP        p50 {:.3} ms   ratio {:.1}\n\
             bag of no-op jobs                    {:.0} jobs/s\n\
             busy jobs of 10 ms                   {:.1} % efficiency\n\
             screening of {} setups               {:.1} % cold, {:.1} % warm, {:.2} ms a run, {:.3} ms to build one\n\
             over TCP, cycle of 10 ms runs        plain {:.2} ms, TLS {:.2} ms: TLS costs {:.1} %; of no-op runs {:.3} and {:.3} ms\n",
            self.cycle_p50_ms,
            self.cycle_p99_ms,
            self.raw_tcp_cycle_p50_ms,
            self.ratio(),
            self.bag_jobs_per_s,
            100.0 * self.efficiency_10ms,
            screening::SETUPS,
            100.0 * self.screening.cold,
            100.0 * self.screening.warm,
            self.screening.run_ms,
            self.screening.build_ms,
            self.tls.plain.busy_ms,
            self.tls.sealed.busy_ms,
            100.0 * self.tls.cost(),
            self.tls.plain.noop_ms,
            self.tls.sealed.noop_ms,
        )
    }
}

fn measure(divisor: usize) -> Result<Figures, Failure> {
    let (mut fleet, workers, events) = local_fleet::start("bench", WORKERS)?;
    for _ in 0..WORKERS {
        while !matches!(events.recv_timeout(Duration::from_secs(30))?, FleetEvent::WorkerJoined { .. }) {}
    }
    let noop = install(&mut fleet, "bench-noop")?;
    let busy = install(&mut fleet, "bench-busy")?;
    run(&mut fleet, noop, 10_000)?;
    let mut cycles = Vec::new();
    for _ in 0..2000 / divisor {
        cycles.push(run(&mut fleet, noop, PARTICLES)?);
    }
    cycles.sort_unstable();
    let n_bag = 100_000 / divisor;
    let bag = run(&mut fleet, noop, n_bag)?;
    let n_busy = 1000 / divisor;
    let wall = run(&mut fleet, busy, n_busy)?;
    let screening = screening::measure(&mut fleet, (SCREENINGS / divisor).max(1))?;
    drop(workers);
    fleet.close();
    Ok(Figures {
        cycle_p50_ms: 1e3 * quantile(&cycles, 0.5),
        cycle_p99_ms: 1e3 * quantile(&cycles, 0.99),
        bag_jobs_per_s: n_bag as f64 / bag.as_secs_f64(),
        efficiency_10ms: n_busy as f64 * BUSY.as_secs_f64() / (WORKERS as f64 * wall.as_secs_f64()),
        screening,
        tls: tls::measure((TURNS / divisor).max(1))?,
        raw_tcp_cycle_p50_ms: 1e3 * raw_tcp(2000 / divisor)?,
    })
}

fn install(fleet: &mut GrpcFleet, kind: &str) -> Result<SetupId, Failure> {
    let model = ModelDef { kind: kind.to_owned(), ..ModelDef::default() };
    Ok(fleet.install(&Setup { model, ..Setup::default() })?)
}

/// Wall time of one batch, from the caller's side.
fn run(fleet: &mut GrpcFleet, setup: SetupId, n: usize) -> Result<Duration, Failure> {
    let window = Arc::new(Window {
        start: 0.0,
        times: vec![1.0],
        observed: vec![2.0; FLOATS],
        inputs: vec![],
        since: vec![],
    });
    let job = |i: usize| Job {
        particle: i as u32,
        record: 0,
        window: Arc::clone(&window),
        theta: vec![1.0; FLOATS],
        state: None,
    };
    let jobs = (0..n).map(job).collect();
    let started = Instant::now();
    let outcomes = fleet.run(setup, jobs)?;
    let wall = started.elapsed();
    let right = outcomes.iter().enumerate().all(|(i, o)| {
        o.result
            .as_ref()
            .is_ok_and(|p| p.outputs.first().is_some_and(|got| got.to_bits() == (i as f64).to_bits()))
    });
    if right && outcomes.len() == n { Ok(wall) } else { Err("an outcome is missing or out of place".into()) }
}

fn quantile(sorted: &[Duration], q: f64) -> f64 {
    sorted.get((q * sorted.len() as f64) as usize).map_or(f64::NAN, Duration::as_secs_f64)
}

/// A forward run that answers at once, or after spinning for a while.
struct Bench {
    spec: Spec,
    spin: Duration,
}

impl Forward for Bench {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        let started = Instant::now();
        while started.elapsed() < self.spin {
            std::hint::spin_loop();
        }
        let mut outputs = job.theta.clone();
        outputs[0] = f64::from(job.particle);
        Ok(Prediction { outputs, state: vec![].into(), cost: 0.0 })
    }
}

fn build(setup: &Setup) -> Result<Box<dyn Forward>, SetupError> {
    let spin = match setup.model.kind.as_str() {
        "bench-noop" => Duration::ZERO,
        "bench-busy" => BUSY,
        "equations" => return setup.build(),
        other => return Err(SetupError::Invalid(format!("no benchmark named {other}"))),
    };
    let spec = Spec {
        kind: setup.model.kind.clone(),
        says: String::new(),
        states: vec![],
        parameters: vec![],
        outputs: vec![],
        inputs: vec![],
        measures: vec![],
        restart: true,
    };
    Ok(Box::new(Bench { spec, spin }))
}

fn work(mut config: WorkerConfig) -> Result<(), Failure> {
    config.once = true;
    config.factory = Arc::new(build);
    starlings_worker::run(config)?;
    Ok(())
}

/// Ends the echo process with the measurement.
struct Echo(Child);

impl Drop for Echo {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Median seconds of one cycle's bytes, there and back, with another process over plain TCP.
fn raw_tcp(cycles: usize) -> Result<f64, Failure> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let address: SocketAddr = listener.local_addr()?;
    let _echo = Echo(Command::new(std::env::current_exe()?).args(["--echo", &address.to_string()]).spawn()?);
    let (mut stream, _) = listener.accept()?;
    stream.set_nodelay(true)?;
    let mut bytes = [0; 200 * PARTICLES];
    let mut walls = Vec::new();
    for _ in 0..cycles {
        let started = Instant::now();
        stream.write_all(&bytes)?;
        stream.read_exact(&mut bytes)?;
        walls.push(started.elapsed());
    }
    walls.sort_unstable();
    Ok(quantile(&walls, 0.5))
}

fn echo(address: &str) -> Result<(), Failure> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    let mut bytes = [0; 200 * PARTICLES];
    while stream.read_exact(&mut bytes).is_ok() {
        stream.write_all(&bytes)?;
    }
    Ok(())
}
