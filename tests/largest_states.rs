//! States of 256 MB of a solver in Python: the posterior of a small state, with memory bounded, and how much every process holds.
//!
//! The coordinator makes a trial and the last run itself, as a worker does; while it fits it holds what `--state-memory` says.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // a failed unwrap is a failed test; what was measured is printed

mod common;

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use common::python::{has_python, path};
use common::{analyses, bytes, starlings};

/// A field that decays everywhere alike, seen in one place: how long it is changes nothing of what is seen.
const SOLVER: &str = r#"
import numpy as np
import starlings

class Field(starlings.Solver):
    parameters = {"k": "1/s"}
    states = [starlings.Quantity("x", size=N)]
    outputs = {"y": ""}
    dt = 0.5

    def initial(self, p):
        return {"x": np.ones(N)}

    def step(self, t, dt, x, p, u):
        return x * (1.0 - p.k * dt)

    def output(self, t, x, p, u):
        return [x[0]]

starlings.serve(Field)
"#;

const STUDY: &str = r#"
[study]
name = "field"
[model]
kind = "solver"
command = ["python3", "field.py"]
[[parameters]]
name = "k"
unit = "1/s"
prior = { transform = "log", median = 0.2, factor = 1.5 }
[[records]]
name = "decay"
file = "y.csv"
time = "time"
channels = [ { column = "y", output = "y", noise = 0.01 } ]
[estimator]
passes = 1
"#;

/// Memory for states at the coordinator: two of them, and a third one in part.
const STATE_MEMORY: u64 = 600_000_000;

/// What processes hold at most, bytes, by what they are.
type Most = BTreeMap<&'static str, u64>;

/// A number of /proc/PID/status, bytes.
fn status(process: u32, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    Some(line.trim().trim_end_matches(" kB").parse::<u64>().ok()? * 1024)
}

/// A process that was started and those that it started, with how deep they are below it.
fn below(process: u32, depth: usize, found: &mut Vec<(u32, usize)>) {
    found.push((process, depth));
    for task in std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten() {
        let children = std::fs::read_to_string(task.path().join("children")).unwrap_or_default();
        for child in children.split_whitespace() {
            below(child.parse().unwrap(), depth + 1, found);
        }
    }
}

/// Bytes of the states that a process has by descriptors of memory.
fn by_descriptors(process: u32) -> u64 {
    let entries = std::fs::read_dir(format!("/proc/{process}/fd")).into_iter().flatten().flatten();
    let states = entries.filter(|entry| {
        std::fs::read_link(entry.path()).is_ok_and(|link| link.to_string_lossy().contains("starlings-state"))
    });
    let pages = states.filter_map(|entry| std::fs::metadata(entry.path()).ok());
    pages.map(|of| (of.ino(), of.blocks() * 512)).collect::<BTreeMap<_, _>>().values().sum()
}

/// Looks at all processes of a run once more, which stores its analyses here.
fn look(run: u32, out: &Path, most: &mut Most) {
    let mut found = Vec::new();
    below(run, 0, &mut found);
    let mut note = |name, bytes: u64| {
        let before = most.entry(name).or_default();
        *before = bytes.max(*before);
    };
    note("states by descriptors", by_descriptors(run));
    // Between the first analysis and the last one.
    if (1..3).contains(&analyses(out)) {
        note("coordinator, fitting", status(run, "VmRSS").unwrap_or(0));
    }
    for (process, depth) in found {
        let name = std::fs::read_to_string(format!("/proc/{process}/comm")).unwrap_or_default();
        let role = match (depth, name.trim()) {
            (0, _) => "coordinator",
            (_, "starlings") => "worker",
            (_, "python3") => "solver",
            _ => continue,
        };
        note(role, status(process, "VmHWM").unwrap_or(0));
    }
}

/// The posterior of the study with a state of so many values, what its processes held, and how long it took.
fn run(folder: &Path, n_state: usize, more: &[&str]) -> (Vec<u8>, Most, Duration) {
    let out: PathBuf = folder.join(format!("out-{n_state}"));
    std::fs::write(folder.join("field.py"), format!("N = {n_state}\n{SOLVER}")).unwrap();
    std::fs::write(folder.join("y.csv"), "time,y\n1,0.81\n2,0.66\n3,0.53\n").unwrap();
    let study = folder.join("study.toml");
    std::fs::write(&study, STUDY).unwrap();
    let mut command = starlings();
    command.arg("run").arg(&study).arg("--out").arg(&out).args(["--workers", "2"]).args(more);
    let started = Instant::now();
    let mut child = command.env("PATH", path()).stdout(Stdio::null()).spawn().unwrap();
    let mut most = Most::new();
    let code = loop {
        look(child.id(), &out, &mut most);
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    assert_eq!(code, Some(0));
    (bytes(&out, "posterior.csv"), most, started.elapsed())
}

#[test]
#[ignore = "eight gigabytes of states: `just largest-states`"]
fn states_of_256_mb_of_a_solver_in_python_give_the_posterior_of_a_small_one_in_bounded_memory() {
    assert!(has_python(), "no Python package: run .ci/solvers first");
    let folder = tempfile::tempdir().unwrap();
    let (small, ..) = run(folder.path(), 1, &[]);
    let memory = format!("{} MB", STATE_MEMORY / 1_000_000);
    let (large, most, took) = run(folder.path(), 32_000_000, &["--state-memory", &memory]);
    for (name, bytes) in &most {
        println!("{name:<22} {:>6} MB at most", bytes / 1_000_000);
    }
    println!("the whole run          {:>6.1} s", took.as_secs_f64());
    assert!(large == small, "{}", String::from_utf8_lossy(&large));
    assert!(most["states by descriptors"] <= STATE_MEMORY);
    // Beside the states a few pieces, windows of the network and the program itself.
    let fitting = most["coordinator, fitting"];
    assert!(fitting <= STATE_MEMORY + 200_000_000, "the coordinator held {fitting} bytes");
    assert!(most["coordinator"] <= most["worker"] + STATE_MEMORY, "more than a run needs: {most:?}");
}
