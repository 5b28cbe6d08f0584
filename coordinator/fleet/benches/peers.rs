//! The cycles of `benches/peers/compare.py` on a fleet of two local workers; a line of JSON with what was measured.
//!
//! Started by `python3 benches/peers/compare.py`, which starts one peer after the other and gives each the same sizes. The program
//! starts itself as worker; with `--spin SECONDS` it is the task of a peer that starts a program per task. Next file to read:
//! `benches/peers/tasks.py`, for the same runs elsewhere.
#![allow(clippy::print_stdout, missing_docs)]

use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use starlings_fleet::{
    Fleet, FleetConfig, FleetEvent, GrpcFleet, Held, LocalConfig, LocalWorkers, SetupId, StateStore,
};
use starlings_models::{Forward, Job, ModelDef, ParticleError, Prediction, Setup, SetupError, Spec, Window};
use starlings_worker::WorkerConfig;
use tokio_util::sync::CancellationToken;

type Failure = Box<dyn std::error::Error>;

/// Values of a state of 8 MB.
const VALUES: usize = 1_000_000;

/// Sizes of the cycles, by their names on the command line.
struct Sizes {
    workers: usize,
    particles: usize,
    cycles: usize,
    bag: usize,
    spins: Vec<f64>,
    spread: Vec<f64>,
    states: usize,
}

fn main() -> Result<(), Failure> {
    let args = std::env::args().skip(1).collect::<Vec<_>>();
    let after = |flag: &str| args.iter().skip_while(|a| *a != flag).nth(1).cloned();
    if let Some(seconds) = after("--spin") {
        spin(seconds.parse()?);
        return Ok(());
    }
    if let Some(address) = after("--connect") {
        let mut config = WorkerConfig::new(address);
        (config.once, config.factory) = (true, Arc::new(build));
        starlings_worker::run(config)?;
        return Ok(());
    }
    let number = |flag: &str| -> Result<usize, Failure> {
        Ok(after(flag).ok_or_else(|| format!("{flag} is missing: start compare.py"))?.parse()?)
    };
    let seconds = |flag: &str| -> Result<Vec<f64>, Failure> {
        let text = after(flag).ok_or_else(|| format!("{flag} is missing: start compare.py"))?;
        Ok(text.split(',').map(str::parse).collect::<Result<_, _>>()?)
    };
    println!(
        "{}",
        measure(&Sizes {
            workers: number("--workers")?,
            particles: number("--particles")?,
            cycles: number("--cycles")?,
            bag: number("--bag")?,
            spins: seconds("--spins")?,
            spread: seconds("--spread")?,
            states: number("--states")?,
        })?
    );
    Ok(())
}

fn measure(sizes: &Sizes) -> Result<String, Failure> {
    let store = StateStore::new(usize::MAX);
    let (mut fleet, workers) = fleet(&store, sizes.workers)?;
    let model = ModelDef { kind: "bench".to_owned(), ..ModelDef::default() };
    let setup = fleet.install(&Setup { model, ..Setup::default() })?;
    let nothing = |n: usize| vec![0.0; n];
    run(&mut fleet, setup, &nothing(10 * sizes.particles))?;
    let mut cycles = Vec::new();
    for _ in 0..sizes.cycles {
        cycles.push(run(&mut fleet, setup, &nothing(sizes.particles))?.as_secs_f64());
    }
    let bag = run(&mut fleet, setup, &nothing(sizes.bag))?.as_secs_f64();
    let spins = run(&mut fleet, setup, &sizes.spins)?.as_secs_f64();
    let spread = run(&mut fleet, setup, &sizes.spread)?.as_secs_f64();
    let mut states = Vec::new();
    let window = Arc::new(window());
    let mut now = (0..sizes.particles).map(|k| start(&store, k)).collect::<Result<Vec<_>, _>>()?;
    for _ in 0..=sizes.states {
        let job = |(k, state): (usize, Held)| Job {
            particle: k as u32,
            record: 0,
            window: Arc::clone(&window),
            theta: vec![0.0],
            state: Some(state),
        };
        let jobs = now.into_iter().enumerate().map(|one| (setup, job(one))).collect();
        let started = Instant::now();
        let outcomes = fleet.run_held(jobs)?;
        states.push(started.elapsed().as_secs_f64());
        now = outcomes.into_iter().map(|o| o.result.map(|p| p.state)).collect::<Result<_, _>>()?;
    }
    drop(workers);
    fleet.close();
    // The first one of the states warms up.
    let of = |walls: &[f64]| format!("{walls:?}");
    Ok(format!(
        "{{\"cycles\":{},\"bag\":{bag},\"spins\":{spins},\"spread\":{spread},\"states\":{}}}",
        of(&cycles),
        of(&states[1..])
    ))
}

fn fleet(store: &StateStore, n: usize) -> Result<(GrpcFleet, LocalWorkers), Failure> {
    let (sender, events) = mpsc::channel();
    let mut config = FleetConfig::new(None, "peers", CancellationToken::new(), sender);
    config.states = store.clone();
    let fleet = GrpcFleet::listen(config)?;
    let program = std::env::current_exe()?;
    let workers = LocalWorkers::spawn(LocalConfig { program, args: vec![], n, fleet: fleet.handle() })?;
    for _ in 0..n {
        while !matches!(events.recv_timeout(Duration::from_secs(60))?, FleetEvent::WorkerJoined { .. }) {}
    }
    Ok((fleet, workers))
}

fn window() -> Window {
    Window { start: 0.0, times: vec![1.0], observed: vec![0.0], inputs: vec![], since: vec![] }
}

/// Wall time of a batch of runs of so many seconds each.
fn run(fleet: &mut GrpcFleet, setup: SetupId, seconds: &[f64]) -> Result<Duration, Failure> {
    let window = Arc::new(window());
    let job = |(i, seconds): (usize, &f64)| Job {
        particle: i as u32,
        record: 0,
        window: Arc::clone(&window),
        theta: vec![*seconds],
        state: None,
    };
    let jobs = seconds.iter().enumerate().map(job).collect();
    let started = Instant::now();
    let outcomes = fleet.run(setup, jobs)?;
    let wall = started.elapsed();
    for (i, outcome) in outcomes.into_iter().enumerate() {
        if outcome.result?.outputs[0].to_bits() != (i as f64).to_bits() {
            return Err("an outcome is out of place".into());
        }
    }
    Ok(wall)
}

fn start(store: &StateStore, particle: usize) -> Result<Held, Failure> {
    let mut writer = store.writer_for_workers(VALUES);
    let mut first = 0;
    while writer.wanted() > 0 {
        let piece: Vec<u8> =
            (first..first + writer.wanted()).flat_map(|i| ((i + particle) as f64).to_le_bytes()).collect();
        first += piece.len() / 8;
        writer.push(piece.into())?;
    }
    Ok(Held::Stored(writer.finish()?))
}

fn spin(seconds: f64) {
    let started = Instant::now();
    while started.elapsed().as_secs_f64() < seconds {
        std::hint::spin_loop();
    }
}

/// Computes for as long as its parameter says, and ends where it starts.
struct Bench(Spec);

impl Forward for Bench {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn run(&self, job: &Job) -> Result<Prediction, ParticleError> {
        spin(job.theta[0]);
        Ok(Prediction {
            outputs: vec![f64::from(job.particle)],
            state: job.state.clone().unwrap_or_default(),
            cost: 0.0,
        })
    }
}

#[expect(clippy::unnecessary_wraps, reason = "as a factory is called")]
fn build(_: &Setup) -> Result<Box<dyn Forward>, SetupError> {
    Ok(Box::new(Bench(Spec { restart: true, ..Spec::default() })))
}
