//! One heart beat of the elastic tube, 800 steps of 25 cells: time, flops per step and GFLOP/s; a study of ten beats.
//!
//! `cargo bench --bench tube` prints a table, with `-- --json` one JSON object. The step alone, segment by segment as a run
//! calls it, with its factors found anew each time; many steps in one segment, which share them; the whole beat as a
//! worker runs it, with the wall observed every 10 ms; and the example `fsi-tube`, six particles of five regions, on two
//! worker processes (the program starts itself), from the study file to the stored summary. No time is asserted; a run that
//! fails ends the benchmark instead of being timed.

#![allow(clippy::print_stdout, clippy::print_stderr, missing_docs)]

#[path = "fleet/local.rs"]
mod local_fleet;

use std::f64::consts::PI;
use std::hint::black_box;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, Value, json};
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::{RunContext, RunFolder, Study, Summary, run::run};
use starlings_models::limits::Limits;
use starlings_models::segment::{History, Segment};
use starlings_models::{BuildSetup, Job, Model, ModelDef, Setup, Signal, Window};
use starlings_worker::WorkerConfig;

type Failure = Box<dyn std::error::Error>;

const CELLS: usize = 25;
const STEPS: usize = 800;
const DT: f64 = 1e-3;

/// Worker processes of a study.
const WORKERS: usize = 2;

/// Flops per cell of a step that finds its own factors, additions, products and divisions alike: stiffness 2, wall 3, factor
/// 5 (one division), load 8, solve 5, update 6.
const FLOPS_PER_CELL: usize = 29;

/// Of these, what a step costs that shares its factors with others.
const SHARED_FLOPS_PER_CELL: usize = 19;

/// Flops per cell of a plain implementation of the same step: a general banded solver, and no term used twice.
const PLAIN_FLOPS_PER_CELL: usize = 45;

fn main() -> ExitCode {
    if let Some(address) = std::env::args().skip_while(|a| a != "--connect").nth(1) {
        return work(address);
    }
    let json = std::env::args().any(|a| a == "--json");
    let mut figures = Map::new();
    let benches = [segments, one_segment, worker, ten_beats];
    if let Err(error) = benches.iter().try_for_each(|bench| bench(&mut figures)) {
        eprintln!("benchmark: {error}");
        return ExitCode::FAILURE;
    }
    if json {
        println!("{}", Value::Object(figures));
    } else {
        for (name, value) in figures {
            println!("{name:36} {value}");
        }
    }
    ExitCode::SUCCESS
}

/// Shortest of `n` timings of `work`, in seconds.
fn best(n: usize, mut work: impl FnMut()) -> f64 {
    (0..n)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn round(value: f64) -> Value {
    json!((value * 1e4).round() / 1e4)
}

fn inflow(t: f64) -> f64 {
    if t < 0.3 { 300.0 * (PI * t / 0.3).sin() } else { 0.0 }
}

fn setup() -> Setup {
    Setup {
        model: ModelDef { kind: "fsi-tube".into(), ..ModelDef::default() },
        parameters: ["E1", "E2", "E3", "E4", "E5"].map(String::from).to_vec(),
        outputs: vec!["displacement".into()],
        ..Setup::default()
    }
}

struct NoHistory;

impl History for NoHistory {
    fn at(&self, _index: usize, _t: f64) -> f64 {
        0.0
    }
}

/// The defaults of the parameters, and the state that they start from.
fn start(model: &dyn Model) -> Result<(Vec<f64>, Vec<f64>), Failure> {
    let list = &model.spec().parameters;
    let theta =
        list.iter().map(|q| q.default.ok_or("a parameter without default")).collect::<Result<Vec<_>, _>>()?;
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(&theta, &mut x);
    Ok((theta, x))
}

fn advance(model: &dyn Model, theta: &[f64], [from, to]: [f64; 2], x: &mut [f64]) -> Result<(), Failure> {
    let (u0, slope) = ([inflow(from)], [(inflow(to) - inflow(from)) / (to - from)]);
    let segment = Segment {
        t0: from,
        t1: to,
        u0: &u0,
        slope: &slope,
        history: &NoHistory,
        limits: &Limits::none(),
        noise: None,
    };
    Ok(model.advance(segment, theta, x)?)
}

/// A beat in segments of one step.
fn segments(figures: &mut Map<String, Value>) -> Result<(), Failure> {
    let model = setup().model()?;
    let (theta, x0) = start(&*model)?;
    let beat = |x: &mut [f64]| -> Result<(), Failure> {
        (0..STEPS).try_for_each(|i| advance(&*model, &theta, [i, i + 1].map(|i| i as f64 * DT), x))
    };
    let mut x = x0.clone();
    beat(&mut x)?;
    let seconds = best(50, || {
        x.copy_from_slice(&x0);
        black_box(beat(&mut x).is_ok());
    });
    let flops = FLOPS_PER_CELL * CELLS;
    figures.insert("flops_per_step".into(), json!(flops));
    figures.insert("flops_per_step_plain".into(), json!(PLAIN_FLOPS_PER_CELL * CELLS));
    figures.insert("flops_over_plain".into(), round(FLOPS_PER_CELL as f64 / PLAIN_FLOPS_PER_CELL as f64));
    figures.insert("beat_steps_ms".into(), round(1e3 * seconds));
    figures.insert("step_ns".into(), round(1e9 * seconds / STEPS as f64));
    figures.insert("step_gflop_per_s".into(), round((flops * STEPS) as f64 / seconds / 1e9));
    Ok(())
}

/// A beat's worth of steps in one segment.
fn one_segment(figures: &mut Map<String, Value>) -> Result<(), Failure> {
    let model = setup().model()?;
    let (theta, x0) = start(&*model)?;
    let mut x = x0.clone();
    advance(&*model, &theta, [0.0, STEPS as f64 * DT], &mut x)?;
    let seconds = best(50, || {
        x.copy_from_slice(&x0);
        black_box(advance(&*model, &theta, [0.0, STEPS as f64 * DT], &mut x).is_ok());
    });
    let flops = SHARED_FLOPS_PER_CELL * CELLS;
    figures.insert("shared_factors_flops_per_step".into(), json!(flops));
    figures.insert("shared_factors_step_ns".into(), round(1e9 * seconds / STEPS as f64));
    figures.insert("shared_factors_gflop_per_s".into(), round((flops * STEPS) as f64 / seconds / 1e9));
    Ok(())
}

/// A beat as a worker runs it: inflow each 1 ms, 25 displacements predicted each 10 ms.
fn worker(figures: &mut Map<String, Value>) -> Result<(), Failure> {
    let times: Vec<f64> = (0..=STEPS).map(|i| i as f64 * DT).collect();
    let values = times.iter().map(|t| inflow(*t)).collect();
    let observed: Vec<f64> = times[1..].iter().skip(9).step_by(10).copied().collect();
    let window = Window::free(0.0, observed, CELLS, vec![Signal { times, values }]);
    let job = Job { particle: 0, record: 0, window: Arc::new(window), theta: vec![5e6; 5], state: None };
    let model = setup().build()?;
    model.run(&job)?;
    let seconds = best(50, || {
        black_box(model.run(black_box(&job)).is_ok());
    });
    figures.insert("beat_ms".into(), round(1e3 * seconds));
    Ok(())
}

/// The example's study on two worker processes, with one pass over the record and with two.
fn ten_beats(figures: &mut Map<String, Value>) -> Result<(), Failure> {
    for (key, passes) in [("tube_study_10_beats_wall_s", 1), ("tube_study_10_beats_two_passes_wall_s", 2)] {
        let mut shortest = f64::INFINITY;
        for _ in 0..3 {
            let folder = tempfile::tempdir()?;
            write_study(folder.path(), passes)?;
            let started = Instant::now();
            let summary = study(folder.path(), started)?;
            shortest = shortest.min(started.elapsed().as_secs_f64());
            let right =
                summary.parameters.len() == 5 && summary.runs.failed == 0 && summary.workers == WORKERS;
            if !right {
                return Err("the study did not run as it should".into());
            }
        }
        figures.insert(key.into(), round(shortest));
    }
    Ok(())
}

/// Copies the example with another number of passes.
fn write_study(folder: &Path, passes: usize) -> Result<(), Failure> {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/fsi-tube");
    for name in ["wall.csv", "flow.csv", "initial.csv"] {
        std::fs::copy(example.join(name), folder.join(name))?;
    }
    let text = std::fs::read_to_string(example.join("study.toml"))?;
    if !text.contains("\n[estimator]\n") {
        return Err("the example no longer has an estimator".into());
    }
    let text = text.replace("\n[estimator]\n", &format!("\n[estimator]\npasses = {passes}\n"));
    Ok(std::fs::write(folder.join("study.toml"), text)?)
}

/// Reads the study, starts its fleet, fits, and stores the run.
fn study(folder: &Path, started: Instant) -> Result<Summary, Failure> {
    let study = Study::load(&folder.join("study.toml"))?;
    let (mut fleet, workers, events) = local_fleet::start(&study.name, WORKERS)?;
    let mut stored = RunFolder::create(Purpose::Run, &folder.join("run"), &study, "benchmark", "")?;
    let clock = || started.elapsed().as_secs_f64();
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut context =
        RunContext { clock: &clock, watch: &mut |_| {}, events: Some(&events), earlier_s: 0.0, threads };
    let summary = run(&study, &mut fleet, &mut stored, &mut context)?;
    fleet.close();
    drop(workers);
    Ok(summary)
}

/// This program as a worker of its own study.
fn work(address: String) -> ExitCode {
    let mut config = WorkerConfig::new(address);
    config.once = true;
    match starlings_worker::run(config) {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("worker: {error}");
            ExitCode::FAILURE
        }
    }
}
