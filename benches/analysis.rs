//! The arithmetic of one analysis and one run, each against its limit measured in the same process.
//!
//! `cargo bench --bench analysis` prints a table, with `-- --json` one JSON object. Absolute times depend on the machine;
//! the ratios are what to watch. No time is asserted; a run that fails ends the benchmark instead of being timed.

#![allow(clippy::print_stdout, clippy::print_stderr, missing_docs)]

use std::collections::BTreeMap;
use std::hint::black_box;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use nalgebra::DMatrix;
use serde_json::{Map, Value, json};
use starlings_coordinator::study::recombine_by;
use starlings_estimators::{Data, Filter, Noise, Particles, Points, Root, Roukf, SigmaSet};
use starlings_models::equations::{EquationsDef, EquationsModel};
use starlings_models::integrate::{Solver, Tolerance};
use starlings_models::limits::Limits;
use starlings_models::segment::{History, Segment};
use starlings_models::{BuildSetup, Drive, Job, Model, ModelDef, Setup, Signal, Spec, Window, advance_by};

type Failure = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    let json = std::env::args().any(|a| a == "--json");
    let mut figures = Map::new();
    let benches = [analysis, recombination, windkessel_beat, equations_against_rust];
    if let Err(error) = benches.iter().try_for_each(|bench| bench(&mut figures)) {
        eprintln!("benchmark: {error}");
        return ExitCode::FAILURE;
    }
    if json {
        println!("{}", Value::Object(figures));
    } else {
        for (name, value) in figures {
            println!("{name:32} {value}");
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

/// One analysis of p = 22 parameters, 23 simplex particles, m = 100 000 observations with independent noise, against its
/// two products Z D I' and S'S alone, in blocks of rows and on the whole.
fn analysis(figures: &mut Map<String, Value>) -> Result<(), Failure> {
    let (p, m) = (22, 100_000);
    let set = SigmaSet::new(Points::Simplex, p)?;
    let r = set.n_particle();
    let roukf = Roukf { set, root: Root::Symmetric };
    let theta = roukf.set.points.clone();
    let z = DMatrix::from_fn(m, r, |i, j| ((i * 31 + j * 17) % 1009) as f64 / 1009.0);
    let values: Vec<f64> = (0..m).map(|i| ((i * 7) % 101) as f64 / 101.0).collect();
    let noise = Noise::Diagonal(vec![20.0; m]);
    let particles = Particles { theta, pull: vec![1.0; r] };
    let data = Data { values: &values, noise: &noise };
    roukf.analysis(&particles, &z, &data)?;
    let seconds = best(20, || {
        black_box(roukf.analysis(&particles, &z, &data).is_ok());
    });
    let dual = DMatrix::from_diagonal(&roukf.set.weights) * roukf.set.points.transpose();
    let limit = best(20, || products_alone(&z, &dual, 512)).min(best(5, || products_alone(&z, &dual, m)));
    // The flops of Z D I' and S'S, the two products of an analysis.
    let flops = 2.0 * (m * r * p + m * p * p) as f64;
    figures.insert("analysis_p22_m100000_ms".into(), round(1e3 * seconds));
    figures.insert("analysis_gflop_per_s".into(), round(flops / seconds / 1e9));
    figures.insert("analysis_gemm_ms".into(), round(1e3 * limit));
    figures.insert("analysis_over_gemm".into(), round(seconds / limit));
    Ok(())
}

/// S = Z D I' and S'S by general matrix products, so many rows at a time.
fn products_alone(z: &DMatrix<f64>, dual: &DMatrix<f64>, block: usize) {
    let (m, p) = (z.nrows(), dual.ncols());
    let (mut s, mut transposed) = (DMatrix::zeros(block, p), DMatrix::zeros(p, block));
    let mut information = DMatrix::<f64>::zeros(p, p);
    for first in (0..m).step_by(block) {
        let rows = block.min(m - first);
        let (mut s, mut transposed) = (s.rows_mut(0, rows), transposed.columns_mut(0, rows));
        s.gemm(1.0, &z.rows(first, rows), dual, 0.0);
        s.transpose_to(&mut transposed);
        information.gemm(1.0, &transposed, &s, 1.0);
    }
    black_box(information);
}

/// X+ = X- T at n = 10^6, r = 22, in place, against memcpy of the same matrix by as many threads.
fn recombination(figures: &mut Map<String, Value>) -> Result<(), Failure> {
    let (n, r) = (1_000_000, 22);
    let mut x = DMatrix::from_fn(n, r, |i, j| (i % 97 + j) as f64);
    let t = DMatrix::from_fn(r, r, |i, j| if i == j { 0.9 } else { 0.1 / 21.0 });
    let mut out = x.clone();
    let expected = (x.row(n - 1) * t.column(r - 1))[0];
    recombine_by(&mut out, &t, 2);
    if (out[(n - 1, r - 1)] - expected).abs() > 1e-9 {
        return Err(format!("the recombination gives {} instead of {expected}", out[(n - 1, r - 1)]).into());
    }
    let bytes = (2 * n * r * 8) as f64;
    let copy = best(10, || black_box(&mut out).as_mut_slice().copy_from_slice(black_box(&x).as_slice()));
    let halves = best(10, || copy_in_halves(&x, &mut out));
    for (threads, name, copy) in [(1, "one_thread", copy), (2, "two_threads", halves)] {
        let product = best(10, || recombine_by(black_box(&mut x), &t, threads));
        figures.insert(format!("memcpy_{name}_gb_per_s"), round(bytes / copy / 1e9));
        figures.insert(format!("recombine_n1e6_r22_{name}_ms"), round(1e3 * product));
        figures.insert(format!("recombine_{name}_share_of_memcpy"), round(copy / product));
    }
    Ok(())
}

/// memcpy shared by two threads: the limit of a recombination that uses two cores.
fn copy_in_halves(x: &DMatrix<f64>, out: &mut DMatrix<f64>) {
    let half = x.len() / 2;
    let (from, to) = (black_box(x).as_slice(), black_box(out).as_mut_slice());
    let (first, second) = to.split_at_mut(half);
    std::thread::scope(|scope| {
        scope.spawn(|| first.copy_from_slice(&from[..half]));
        second.copy_from_slice(&from[half..]);
    });
}

/// One beat of the three-element Windkessel: 200 steps of 5 ms, an output at each, as a worker runs it.
fn windkessel_beat(figures: &mut Map<String, Value>) -> Result<(), Failure> {
    let setup = Setup {
        model: ModelDef { kind: "windkessel-3".into(), ..ModelDef::default() },
        parameters: ["R", "C", "Zc", "initial:p"].map(String::from).to_vec(),
        outputs: vec!["pressure".into()],
        ..Setup::default()
    };
    let times: Vec<f64> = (0..=200).map(|k| 0.005 * f64::from(k)).collect();
    let flow = times.iter().map(|t| if *t < 0.3 { 300.0 * (10.472 * t).sin() } else { 0.0 }).collect();
    let window = Window::free(0.0, times[1..].to_vec(), 1, vec![Signal { times, values: flow }]);
    let job = Job {
        particle: 0,
        record: 0,
        window: Arc::new(window),
        theta: vec![3.4, 1.2, 0.1, 100.0],
        state: None,
    };
    let model = setup.build()?;
    model.run(&job)?;
    let beat = || {
        for _ in 0..100 {
            black_box(model.run(black_box(&job)).is_ok());
        }
    };
    figures.insert("windkessel_beat_us".into(), round(1e6 * best(20, beat) / 100.0));
    Ok(())
}

/// A Duffing oscillator with a known force, in Rust; its twin below is written as equations.
struct Duffing {
    spec: Spec,
}

impl Model for Duffing {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn initial(&self, _theta: &[f64], x: &mut [f64]) {
        x.copy_from_slice(&[0.1, 0.0]);
    }

    fn rhs(&self, t: f64, x: &[f64], theta: &[f64], _u: Drive<'_>, dx: &mut [f64]) {
        let [k, c, b] = [theta[0], theta[1], theta[2]];
        dx[0] = x[1];
        dx[1] = -k * x[0] - c * x[1] - b * x[0] * x[0] * x[0] + (1.2 * t).cos();
    }

    fn output(&self, _t: f64, x: &[f64], _theta: &[f64], _u: Drive<'_>, y: &mut [f64]) {
        y[0] = x[0];
    }
}

const DUFFING: &str = r#"{ "states": [
    { "name": "x", "initial": "0.1", "rate": [["x", "v"]] },
    { "name": "v", "initial": "0", "rate": [["spring", "-k*x"], ["viscous", "-c*v"], ["cubic", "-b*x^3"], ["drive", "cos(1.2*t)"]] }
  ], "outputs": [ { "name": "position", "value": "x" } ], "solver": { "method": "dopri5" } }"#;

struct NoHistory;

impl History for NoHistory {
    fn at(&self, _index: usize, _t: f64) -> f64 {
        0.0
    }
}

/// The same model, the same integrator, the same tolerance: what the expression language costs.
fn equations_against_rust(figures: &mut Map<String, Value>) -> Result<(), Failure> {
    let def: EquationsDef = serde_json::from_str(DUFFING)?;
    let equations = EquationsModel::new(&def)?;
    let rust = Duffing { spec: equations.spec().clone() };
    let order: BTreeMap<&str, f64> = [("k", 1.0), ("c", 0.1), ("b", 0.5)].into();
    let theta: Vec<f64> = equations.spec().parameters.iter().map(|q| order[q.name.as_str()]).collect();
    let segment = Segment {
        t0: 0.0,
        t1: 50.0,
        u0: &[],
        slope: &[],
        history: &NoHistory,
        limits: &Limits::none(),
        noise: None,
    };
    let mut x = [0.1, 0.0];
    advance_by(&rust, Solver::Dopri5(Tolerance::default()), segment, &[1.0, 0.1, 0.5], &mut x)?;
    let native = best(20, || {
        x = [0.1, 0.0];
        black_box(
            advance_by(&rust, Solver::Dopri5(Tolerance::default()), segment, &[1.0, 0.1, 0.5], &mut x)
                .is_ok(),
        );
    });
    let by_rust = x;
    x = [0.1, 0.0];
    equations.advance(segment, &theta, &mut x)?;
    let written = best(20, || {
        x = [0.1, 0.0];
        black_box(equations.advance(segment, &theta, &mut x).is_ok());
    });
    figures.insert("duffing_rust_us".into(), round(1e6 * native));
    figures.insert("duffing_equations_us".into(), round(1e6 * written));
    figures.insert("equations_over_rust".into(), round(written / native));
    figures.insert("equations_minus_rust".into(), json!((x[0] - by_rust[0]).abs()));
    Ok(())
}
