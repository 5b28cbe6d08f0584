//! A study whose solver misbehaves, and what it leaves behind.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{output, starlings, wait_until};

/// How long processes may take to be gone after their worker was told to end.
const GONE: Duration = Duration::from_secs(5);

const STUDY: &str = r#"
[study]
name = "cooling"
seed = 1

[model]
kind = "solver"
adapter = "command"
command = ["python3", "solver.py"]
timeout = 100
parameters = [{ name = "rate", unit = "1/s" }, { name = "start", unit = "K" }]
outputs = [{ name = "excess", unit = "K" }]

[[parameters]]
name = "rate"
unit = "1/s"
prior = { transform = "log", median = 1.0, factor = 1.5 }

[[parameters]]
name = "start"
unit = "K"
prior = { transform = "linear", median = 10.0, sd = 1.0 }

[[records]]
name = "cup"
file = "cup.csv"
channels = [{ column = "excess", output = "excess", noise = 0.1 }]

[fleet]
workers = 2
slots = 1
"#;

/// A sound solver, with lines in front of its answer.
const SOLVER: &str = r#"
import json, math, os, signal, subprocess, sys, time
run = json.load(sys.stdin)
rate, start = run["parameters"]["rate"], run["parameters"]["start"]
excess = [start * math.exp(-rate * t) for t in run["times"]]
MISBEHAVE
print(json.dumps({"excess": excess}))
"#;

/// A study with a solver that misbehaves, and a folder for temporary files of its own.
pub(crate) struct BadSolverStudy(pub(crate) tempfile::TempDir);

impl BadSolverStudy {
    pub(crate) fn new(misbehave: &str) -> Self {
        let place = Self(tempfile::Builder::new().prefix("bad-").tempdir().unwrap());
        std::fs::create_dir(place.temporary()).unwrap();
        let mut data = "time,excess\n".to_owned();
        for i in 0..20 {
            let time = 0.1 * f64::from(i + 1);
            // The noise is a fixed pattern of the size that the study says.
            let noise = 0.1 * (f64::from(i) * 2.3).sin();
            writeln!(data, "{time},{}", 9.5 * (-1.1 * time).exp() + noise).unwrap();
        }
        place.write("cup.csv", &data);
        place.write("solver.py", &SOLVER.replace("MISBEHAVE", misbehave));
        place.write("study.toml", STUDY);
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub(crate) fn temporary(&self) -> PathBuf {
        self.path("tmp")
    }

    /// A command on the study, whose temporary files are this place's.
    pub(crate) fn command(&self, name: &str) -> Command {
        let mut command = starlings();
        command.arg(name).arg(self.path("study.toml")).env("TMPDIR", self.temporary());
        if name == "run" {
            command.arg("--out").arg(self.path("out"));
        }
        command
    }

    /// Exit code and standard error in one line.
    pub(crate) fn told(&self, name: &str) -> (i32, String) {
        let (code, _, stderr) = output(&mut self.command(name));
        let said = stderr.replace(['│', '\n'], " ");
        (code, said.split_whitespace().collect::<Vec<_>>().join(" "))
    }

    /// A command whose solvers block, once each of two has said which processes it is.
    pub(crate) fn blocked(&self) -> (Child, Vec<i32>) {
        let mut command = self.command("run");
        let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        wait_until("two solvers block", || self.groups().len() >= 2);
        (child, self.groups())
    }

    /// Process groups of solvers that block, told by themselves.
    pub(crate) fn groups(&self) -> Vec<i32> {
        let of = |entry: std::fs::DirEntry| {
            entry.file_name().to_str()?.strip_prefix("group-")?.parse::<i32>().ok()
        };
        std::fs::read_dir(self.0.path()).unwrap().flatten().filter_map(of).collect()
    }

    /// Scratch folders that are left: the name of each, and how many folders of runs are in it.
    pub(crate) fn left(&self) -> Vec<(String, usize)> {
        let of = |entry: std::fs::DirEntry| {
            let name = entry.file_name().into_string().unwrap();
            let inner = std::fs::read_dir(entry.path()).map_or(0, Iterator::count);
            name.starts_with("starlings-").then_some((name, inner))
        };
        std::fs::read_dir(self.temporary()).unwrap().flatten().filter_map(of).collect()
    }
}

/// Lines with which a solver that is not at the prior median blocks for ever with a child, deaf to requests to end.
pub(crate) fn blocking(place: &Path) -> String {
    format!(
        r#"
if abs(rate - 1) > 1e-6 or abs(start - 10) > 1e-6:
    for name in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(name, signal.SIG_IGN)
    subprocess.Popen(["sleep", "600"])
    open(f"{}/group-{{os.getpgrp()}}", "w").close()
    while True:
        time.sleep(1)
"#,
        place.display()
    )
}

pub(crate) fn blocking_place() -> BadSolverStudy {
    let place = BadSolverStudy::new("");
    place.write("solver.py", &SOLVER.replace("MISBEHAVE", &blocking(place.0.path())));
    place
}

/// Processes of a group that have not ended.
pub(crate) fn members(group: i32) -> usize {
    let of = |entry: std::fs::DirEntry| {
        let stat = std::fs::read_to_string(entry.path().join("stat")).ok()?;
        let fields: Vec<&str> = stat.rsplit(") ").next()?.split(' ').collect();
        (fields[0] != "Z" && fields[2] == group.to_string()).then_some(())
    };
    std::fs::read_dir("/proc").unwrap().flatten().filter_map(of).count()
}

/// Waits until no process of these groups is left, which must not take long.
pub(crate) fn gone(groups: &[i32]) {
    let started = Instant::now();
    wait_until("no process is left", || groups.iter().all(|group| members(*group) == 0));
    assert!(started.elapsed() < GONE, "it took {:?}", started.elapsed());
}

/// Local workers of a command.
pub(crate) fn workers(of: &Child) -> Vec<String> {
    let parent = of.id().to_string();
    let is_worker = |entry: std::fs::DirEntry| {
        let stat = std::fs::read_to_string(entry.path().join("stat")).ok()?;
        let fields: Vec<&str> = stat.rsplit(") ").next()?.split(' ').collect();
        let line = std::fs::read(entry.path().join("cmdline")).ok()?;
        let is_worker = String::from_utf8_lossy(&line).split('\0').nth(1) == Some("worker");
        (is_worker && fields[1] == parent).then(|| entry.file_name().into_string().unwrap())
    };
    std::fs::read_dir("/proc").unwrap().flatten().filter_map(is_worker).collect()
}

pub(crate) fn signal(name: &str, pid: &str) {
    assert!(Command::new("kill").args([name, pid]).status().unwrap().success());
}
