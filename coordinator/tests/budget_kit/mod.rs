//! Small studies with something missing, a fleet that counts its jobs, and the explanation of a study with a budget.
#![allow(dead_code, missing_docs, unreachable_pub, clippy::unwrap_used)]

use std::path::Path;

use starlings_coordinator::explain::{Context, ExplainError, Explanation, Options, explain};
use starlings_coordinator::fleet::{Fleet, FleetError, InProcess, Outcome, SetupId};
use starlings_coordinator::study::store::Store;
use starlings_coordinator::study::twin::{Twin, simulate};
use starlings_models::{Job, Setup};

use crate::study_kit::{Case, csv, grid};

/// A built-in model with a step of its own: effects in its rates are compared with a run of their own.
pub const VESSEL: &str = r#"
[study]
name = "vessel"
seed = 1
time_unit = "s"

[model]
kind = "windkessel-2"

[[parameters]]
name = "R"
unit = "mmHg s/mL"
prior = { transform = "log", median = 1.0, factor = 2.0 }

[[parameters]]
name = "C"
unit = "mL/mmHg"
prior = { transform = "log", median = 1.5, factor = 2.0 }

[[records]]
name = "beats"
file = "beats.csv"
time = "time"
inputs = { flow = "flow" }
channels = [ { column = "pressure", output = "pressure", noise = 1.0 } ]
train = [0.0, 3.0]

[explain]
only = ["series-resistance", "nonlinear-compliance", "inertance"]
"#;

/// A relaxation whose rate is no number beyond the prior median of its first parameter, two terms that look alike, and one
/// that has no influence at any amplitude and is measured again and again.
pub const BRINK: &str = r#"
[study]
name = "brink"
seed = 2

[model]
kind = "equations"
outputs = [ { name = "level", unit = "V", value = "h" } ]

[[model.states]]
name = "h"
unit = "V"
initial = 2.0
rate = "-k*h + 0*sqrt(0.5 - k)"

[[model.states]]
name = "idle"
initial = 1.0
rate = "-idle"

[[parameters]]
name = "k"
unit = "1/s"
prior = { transform = "linear", median = 0.5, sd = 0.2 }

[[records]]
name = "emptying"
file = "emptying.csv"
time = "time"
channels = [ { column = "level", output = "level", noise = 0.01 } ]
train = [0.0, 6.0]

[explain]
only = ["leak", "seep", "unseen"]

[[effects]]
name = "leak"
says = "A leak grows with the square of the level."
adds = [ { to = "h", term = "-a*h*abs(h)" } ]
parameters = [ { name = "a", unit = "1/(V s)", range = [0, 10] } ]

[[effects]]
name = "seep"
says = "A leak that grows with the square of the level, nearly."
adds = [ { to = "h", term = "-b*h*abs(h + 0.001)" } ]
parameters = [ { name = "b", unit = "1/(V s)", range = [0, 10] } ]

[[effects]]
name = "unseen"
says = "Nothing that is measured knows of it."
adds = [ { to = "idle", term = "-d*idle" } ]
parameters = [ { name = "d", unit = "1/s", range = [0, 10] } ]
"#;

/// Counts the jobs that it computes and loses one of them, if any.
pub struct Counting {
    inner: InProcess,
    pub calls: usize,
    pub jobs: u64,
    lost: Option<usize>,
}

impl Counting {
    pub fn new(lost: Option<usize>) -> Self {
        Self { inner: InProcess::new(1), calls: 0, jobs: 0, lost }
    }
}

impl Fleet for Counting {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        self.inner.install(setup)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        self.jobs += jobs.len() as u64;
        if self.lost == Some(self.calls) {
            let Job { particle, record, .. } = jobs[0].1;
            let reason = "the machine went away".to_owned();
            return Err(FleetError::NoAnswer { job: 0, particle, record, reason });
        }
        self.calls += 1;
        self.inner.run_mixed(jobs)
    }

    fn n_workers(&self) -> usize {
        1
    }

    fn slots(&self) -> usize {
        1
    }
}

/// A study and what its model measures with these effects and parameters, and noise.
pub fn case(text: &str, file: &str, columns: &[(&str, Vec<f64>)], twin: &Twin) -> Case {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let table = |measured: &[f64]| {
        let values: Vec<&[f64]> =
            columns.iter().map(|(_, v)| if v.is_empty() { measured } else { v.as_slice() }).collect();
        csv(&names.join(","), &values)
    };
    let n = columns[0].1.len();
    let blank = Case::new(text, &[(file, table(&vec![0.0; n]))]);
    let made = simulate(&blank.study(), twin).unwrap();
    Case::new(text, &[(file, table(&made.values[0]))])
}

pub fn named(list: &[(&str, f64)]) -> Vec<(String, f64)> {
    list.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
}

pub fn vessel() -> Case {
    let times = grid(120, 0.04);
    let flow = |t: &f64| if t.fract() < 0.3 { 200.0 * (10.5 * t.fract()).sin().max(0.0) } else { 0.0 };
    let flow = times.iter().map(flow).collect();
    let twin = Twin {
        values: named(&[("R", 1.2), ("C", 1.1)]),
        effects: named(&[("series-resistance", 0.05)]),
        noise: 1.0,
        ..Twin::default()
    };
    case(VESSEL, "beats.csv", &[("time", times), ("pressure", Vec::new()), ("flow", flow)], &twin)
}

pub fn brink() -> Case {
    let twin = Twin {
        values: named(&[("k", 0.05)]),
        effects: named(&[("leak", 0.15)]),
        noise: 0.01,
        ..Twin::default()
    };
    case(BRINK, "emptying.csv", &[("time", grid(80, 0.1)), ("level", Vec::new())], &twin)
}

pub fn go(
    case: &Case,
    path: &Path,
    fleet: &mut dyn Fleet,
    budget: Option<u64>,
) -> Result<Explanation, ExplainError> {
    std::fs::create_dir_all(path).unwrap();
    let database = path.join("run.db");
    let store =
        if database.exists() { Store::open(&database) } else { Store::create(&database, &[]) }.unwrap();
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let options = Options { budget, ..Options::default() };
    Ok(explain(&case.study(), fleet, &store, &mut context, &options)?.explanation)
}

pub fn stage(found: &Explanation, name: &str) -> u64 {
    found.runs_by_stage.iter().find(|(stage, _)| stage == name).map_or(0, |(_, runs)| *runs)
}
