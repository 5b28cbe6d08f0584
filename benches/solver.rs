//! What it costs to have a run made outside: over calling the model directly, over fork and exec, and for a large state.
//!
//! `cargo bench --bench solver -- [--json]`. A solver in Rust is `starlings serve`; the ones in Python need the package
//! (`.ci/solvers` installs it; put `target/solvers/bin` on the path) and are left out without it. Medians of single calls.
#![allow(clippy::print_stdout, missing_docs)]

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use starlings_models::{
    BuildSetup, Description, FilesDef, Forward, Job, ModelDef, Quantity, SOLVER, Setup, Signal, SolverDef,
    Spec, StateValues, Window,
};
use starlings_solver::{SiteOptions, Solvers};

type Failure = Box<dyn std::error::Error>;

/// Runs measured, after as many as a tenth of them to warm up.
const RUNS: usize = 1000;
/// Runs with a large state.
const LARGE: usize = 40;
/// Numbers of the large state: 8 MB.
const NUMBERS: usize = 1_000_000;

fn main() -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    let mut figures = Vec::new();
    rust(folder.path(), &mut figures)?;
    command(folder.path(), &mut figures)?;
    let has_package =
        Command::new("python3").args(["-c", "import starlings"]).stderr(Stdio::null()).status()?.success();
    if has_package {
        python(folder.path(), &mut figures)?;
    }
    if std::env::args().any(|argument| argument == "--json") {
        println!("{:#}", serde_json::to_value(figures.into_iter().collect::<BTreeMap<_, _>>())?);
    } else {
        for (name, value) in figures {
            println!("{name:<62} {value:9.4}");
        }
        if !has_package {
            println!("no Python package: the solvers in Python are left out");
        }
    }
    Ok(())
}

type Figures = Vec<(&'static str, f64)>;

/// Median time of one call, milliseconds.
fn median(n: usize, mut call: impl FnMut()) -> f64 {
    (0..n / 10).for_each(|_| call());
    let mut times: Vec<Duration> = (0..n)
        .map(|_| {
            let started = Instant::now();
            call();
            started.elapsed()
        })
        .collect();
    times.sort_unstable();
    times[n / 2].as_secs_f64() * 1e3
}

const STUDY: &str = r#"
[study]
name = "bench"
[model]
kind = "equations"
outputs = [{ name = "place", value = "x" }]
inputs = [{ name = "f" }]
[[model.states]]
name = "x"
initial = 0.1
rate = "v"
[[model.states]]
name = "v"
initial = 0
rate = "-k*x - 0.3*v + f"
[[parameters]]
name = "k"
prior = { transform = "log", median = 20.0, factor = 1.5 }
[[records]]
name = "r"
file = "data.csv"
time = "t"
inputs = { f = "y" }
channels = [{ column = "y", output = "place", noise = 0.1 }]
"#;

/// One step of an oscillator: `starlings serve` against the same model in this process.
fn rust(folder: &Path, figures: &mut Figures) -> Result<(), Failure> {
    let study = folder.join("study.toml");
    std::fs::write(&study, STUDY)?;
    std::fs::write(folder.join("data.csv"), "t,y\n0,0.1\n0.1,0.1\n0.2,0.1\n0.3,0.1\n")?;
    let program = env!("CARGO_BIN_EXE_starlings").to_owned();
    let command = vec![program, "serve".to_owned(), study.display().to_string()];
    let native = starlings_coordinator::study::Study::load(&study)?.setup;
    let outside = outside(&native, SolverDef { command, ..SolverDef::default() })?;
    let native = native.build()?;
    let job = step(vec![20.0], 1, None);
    let direct = median(RUNS, || drop(native.run(&job)));
    let served = median(RUNS, || drop(outside.run(&job)));
    figures.push(("Rust: the model in this process, ms", direct));
    figures.push(("Rust: over the wire, ms", served));
    figures.push(("Rust: overhead, ms (limit 0.3)", served - direct));
    Ok(())
}

/// A program started for every run against fork and exec of the same program.
fn command(folder: &Path, figures: &mut Figures) -> Result<(), Failure> {
    let mut spec = Spec { kind: SOLVER.to_owned(), ..Spec::default() };
    spec.parameters = vec![Quantity::new("k", "")];
    spec.outputs = vec![Quantity::new("place", "")];
    spec.inputs = vec![Quantity::new("f", "")];
    let described =
        Description { spec, name: "echo".to_owned(), deterministic: true, ..Description::default() };
    let reads = BTreeMap::from([("place".to_owned(), "csv:-:y".to_owned())]);
    let words = ["/usr/bin/printf", "y\\n1\\n"].map(str::to_owned);
    let def = SolverDef {
        adapter: "command".to_owned(),
        command: words.to_vec(),
        folder: folder.display().to_string(),
        files: Some(FilesDef { reads, ..FilesDef::default() }),
        described: Some(described),
        ..SolverDef::default()
    };
    let setup = Setup {
        model: ModelDef { kind: SOLVER.to_owned(), solver: Some(Box::new(def)), ..ModelDef::default() },
        parameters: vec!["k".to_owned()],
        outputs: vec!["place".to_owned()],
        ..Setup::default()
    };
    let outside = solvers().build(&setup)?;
    let job = step(vec![20.0], 1, None);
    outside.run(&job)?;
    let bare = median(RUNS / 4, || {
        let child = Command::new(&words[0]).arg(&words[1]).stdin(Stdio::null()).output();
        drop(child);
    });
    let ran = median(RUNS / 4, || drop(outside.run(&job)));
    figures.push(("command: fork and exec, ms", bare));
    figures.push(("command: a run, ms", ran));
    figures.push(("command: overhead, ms (limit 3)", ran - bare));
    Ok(())
}

const STEP: &str = r#"
import sys, time
import numpy as np
import starlings

class Plain:
    parameters = {"k": ""}
    states = [starlings.Quantity("x", size=2)]
    outputs = {"place": ""}
    inputs = {"f": ""}
    def initial(self, p): return [0.1, 0.0]
    def step(self, t, dt, x, p, u): return [x[0] + dt * x[1], x[1] - dt * p.k * x[0] + dt * u.f]
    def output(self, t, x, p, u): return [x[0]]

class Large:
    parameters = {"k": ""}
    states = [starlings.Quantity("x", size=1000000)]
    outputs = {"place": ""}
    inputs = {"f": ""}
    def initial(self, p): return np.zeros(1000000)
    def step(self, t, dt, x, p, u): return x
    def output(self, t, x, p, u): return [x[0]]

if sys.argv[1] == "direct":
    class Values:
        k, f = 20.0, 0.1
    solver, values, times = Plain(), Values(), []
    for _ in range(2000):
        started = time.perf_counter()
        x = solver.step(0.0, 0.1, [0.1, 0.0], values, values)
        solver.output(0.1, x, values, values)
        times.append(time.perf_counter() - started)
    print(sorted(times)[1000] * 1e3)
else:
    base = Large if sys.argv[1] == "large" else Plain
    starlings.serve(type("Served", (base, starlings.Solver), {}))
"#;

/// One step of a solver in Python against calling its functions, and a state of 8 MB both ways.
fn python(folder: &Path, figures: &mut Figures) -> Result<(), Failure> {
    let script = folder.join("step.py");
    std::fs::File::create(&script)?.write_all(STEP.as_bytes())?;
    let script = script.display().to_string();
    let output = Command::new("python3").args([&script, "direct"]).output()?;
    let direct: f64 = String::from_utf8(output.stdout)?.trim().parse()?;
    let of = |which: &str| {
        let command = ["python3", &script, which].map(str::to_owned).to_vec();
        let setup =
            Setup { parameters: vec!["k".to_owned()], outputs: vec!["place".to_owned()], ..Setup::default() };
        outside(&setup, SolverDef { command, ..SolverDef::default() })
    };
    let plain = of("plain")?;
    let job = step(vec![20.0], 1, None);
    plain.run(&job)?;
    let served = median(RUNS, || drop(plain.run(&job)));
    figures.push(("Python: the functions called directly, ms", direct));
    figures.push(("Python: over the wire, ms", served));
    figures.push(("Python: overhead, ms (limit 1)", served - direct));
    let large = of("large")?;
    let job = step(vec![20.0], 2, Some(vec![0.5; NUMBERS].into()));
    large.run(&job)?;
    let milliseconds = median(LARGE, || drop(large.run(&job)));
    let rate = 2.0 * 8.0 * NUMBERS as f64 / (milliseconds * 1e-3) / 1e9;
    figures.push(("Python: 8 MB of state there and back, ms", milliseconds));
    figures.push(("Python: state, GB/s both ways (at least 0.5)", rate));
    Ok(())
}

fn solvers() -> Solvers {
    Solvers::new(SiteOptions::default())
}

/// The setup with its model in a solver.
fn outside(native: &Setup, def: SolverDef) -> Result<Box<dyn Forward>, Failure> {
    let solvers = solvers();
    let described = Some(solvers.describe(&def)?);
    let solver = Some(Box::new(SolverDef { described, ..def }));
    let model = ModelDef { kind: SOLVER.to_owned(), solver, ..ModelDef::default() };
    Ok(solvers.build(&Setup { model, ..native.clone() })?)
}

/// A window of one observation.
fn step(theta: Vec<f64>, i: usize, state: Option<StateValues>) -> Job {
    let (start, end) = (0.1 * (i as f64 - 1.0), 0.1 * i as f64);
    let window =
        Window::free(start, vec![end], 1, vec![Signal { times: vec![0.0, 1.0], values: vec![0.1, 0.1] }]);
    Job { particle: 0, record: 0, window: Arc::new(window), theta, state }
}
