//! Bad solvers as a user meets them: what the command says, with which exit code, and what stays behind.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
#[path = "solver_kit/mod.rs"]
mod kit;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{output, starlings, wait_until};

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
struct Place(tempfile::TempDir);

impl Place {
    fn new(misbehave: &str) -> Self {
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

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn temporary(&self) -> PathBuf {
        self.path("tmp")
    }

    /// A command on the study, whose temporary files are this place's.
    fn command(&self, name: &str) -> Command {
        let mut command = starlings();
        command.arg(name).arg(self.path("study.toml")).env("TMPDIR", self.temporary());
        if name == "run" {
            command.arg("--out").arg(self.path("out"));
        }
        command
    }

    /// Exit code and standard error in one line.
    fn told(&self, name: &str) -> (i32, String) {
        let (code, _, stderr) = output(&mut self.command(name));
        let said = stderr.replace(['│', '\n'], " ");
        (code, said.split_whitespace().collect::<Vec<_>>().join(" "))
    }

    /// A command whose solvers block, once each of two has said which processes it is.
    fn blocked(&self) -> (Child, Vec<i32>) {
        let mut command = self.command("run");
        let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        wait_until("two solvers block", || self.groups().len() >= 2);
        (child, self.groups())
    }

    /// Process groups of solvers that block, told by themselves.
    fn groups(&self) -> Vec<i32> {
        let of = |entry: std::fs::DirEntry| {
            entry.file_name().to_str()?.strip_prefix("group-")?.parse::<i32>().ok()
        };
        std::fs::read_dir(self.0.path()).unwrap().flatten().filter_map(of).collect()
    }

    /// Scratch folders that are left: the name of each, and how many folders of runs are in it.
    fn left(&self) -> Vec<(String, usize)> {
        let of = |entry: std::fs::DirEntry| {
            let name = entry.file_name().into_string().unwrap();
            let inner = std::fs::read_dir(entry.path()).map_or(0, Iterator::count);
            name.starts_with("starlings-").then_some((name, inner))
        };
        std::fs::read_dir(self.temporary()).unwrap().flatten().filter_map(of).collect()
    }
}

/// Lines with which a solver that is not at the prior median blocks for ever with a child, deaf to requests to end.
fn blocking(place: &Path) -> String {
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

fn blocking_place() -> Place {
    let place = Place::new("");
    place.write("solver.py", &SOLVER.replace("MISBEHAVE", &blocking(place.0.path())));
    place
}

/// Processes of a group that have not ended.
fn members(group: i32) -> usize {
    let of = |entry: std::fs::DirEntry| {
        let stat = std::fs::read_to_string(entry.path().join("stat")).ok()?;
        let fields: Vec<&str> = stat.rsplit(") ").next()?.split(' ').collect();
        (fields[0] != "Z" && fields[2] == group.to_string()).then_some(())
    };
    std::fs::read_dir("/proc").unwrap().flatten().filter_map(of).count()
}

/// Waits until no process of these groups is left, which must not take long.
fn gone(groups: &[i32]) {
    let started = Instant::now();
    wait_until("no process is left", || groups.iter().all(|group| members(*group) == 0));
    assert!(started.elapsed() < GONE, "it took {:?}", started.elapsed());
}

/// Local workers of a command.
fn workers(of: &Child) -> Vec<String> {
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

fn signal(name: &str, pid: &str) {
    assert!(Command::new("kill").args([name, pid]).status().unwrap().success());
}

#[test]
fn a_solver_that_fails_at_the_prior_median_ends_the_command_before_anything_is_made() {
    let place = Place::new("sys.exit('cannot read mesh.vtk')");
    for name in ["check", "run"] {
        let (code, said) = place.told(name);
        assert_eq!(code, 2, "{said}");
        for words in [
            "on record `cup` (rate = 1, start = 10)",
            "the solver `python3` exited with status 1",
            "the end of its output: cannot read mesh.vtk",
        ] {
            assert!(said.contains(words), "`{words}` is missing in: {said}");
        }
    }
    assert!(!place.path("out").exists());
}

#[test]
fn a_particle_that_fails_is_told_with_its_record_and_values_and_the_study_goes_on() {
    let place = Place::new("if rate < 0.96: sys.exit('cannot factor the matrix')");
    let (code, said) = place.told("run");
    assert_eq!(code, 0, "{said}");
    let (_, rest) = said.split_once(", record 0 (rate = 0.95").unwrap_or_else(|| panic!("{said}"));
    let (values, rest) = rest.split_once("): given up after 2 attempts: ").unwrap();
    assert!(values.contains(", start = "), "{said}");
    assert!(rest.starts_with("the solver failed: the solver `python3` exited with status 1"), "{said}");
    assert!(rest.contains("the end of its output: cannot factor the matrix"), "{said}");
    assert!(place.path("out").join("posterior.csv").exists());
    // What stays are folders of failed runs, and nothing else.
    assert!(!place.left().is_empty() && place.left().iter().all(|(_, runs)| *runs > 0), "{:?}", place.left());
}

#[test]
fn a_solver_that_fails_everywhere_but_at_the_prior_median_ends_the_run_with_its_words() {
    let place = Place::new("if abs(rate - 1) > 1e-6 or abs(start - 10) > 1e-6: sys.exit('no licence left')");
    let (code, said) = place.told("run");
    assert_eq!(code, 1, "{said}");
    for words in ["particle 1, record 0 (rate = ", "no licence left", "error: "] {
        assert!(said.contains(words), "`{words}` is missing in: {said}");
    }
}

#[test]
fn an_answer_that_is_no_number_is_told_like_any_other_failure() {
    let place = Place::new("if rate < 0.96: excess[3] = float('nan')");
    let (code, said) = place.told("run");
    assert_eq!(code, 0, "{said}");
    assert!(said.contains(", record 0 (rate = 0.95") && said.contains("given up after 2 attempts"), "{said}");
    assert!(said.contains("excess"), "{said}");
}

#[test]
fn an_interrupted_command_leaves_no_solver_and_no_folder() {
    let place = blocking_place();
    let (mut command, groups) = place.blocked();
    assert!(groups.iter().all(|group| members(*group) == 2), "the solver and its child");
    signal("-INT", &command.id().to_string());
    gone(&groups);
    assert_eq!(command.wait().unwrap().code(), Some(130));
    wait_until("no folder is left", || place.left().is_empty());
}

#[test]
fn a_worker_that_is_told_to_end_leaves_no_solver_and_no_folder() {
    let place = blocking_place();
    let (mut command, groups) = place.blocked();
    for worker in workers(&command) {
        let own =
            |place: &Place| place.left().iter().any(|(n, _)| n.starts_with(&format!("starlings-{worker}-")));
        assert!(own(&place), "its solver has a folder");
        signal("-TERM", &worker);
        wait_until("its folder is gone", || !own(&place));
    }
    gone(&groups);
    common::kill(&mut command);
    wait_until("no later solver is left", || place.groups().iter().all(|group| members(*group) == 0));
}

#[test]
fn a_killed_worker_leaves_no_folder() {
    let place = blocking_place();
    let (mut command, groups) = place.blocked();
    let worker = workers(&command).remove(0);
    let own = || place.left().iter().any(|(name, _)| name.starts_with(&format!("starlings-{worker}-")));
    assert!(own(), "its solver has a folder");
    signal("-9", &worker);
    wait_until("its folder is gone", || !own());
    common::kill(&mut command);
    gone(&groups);
    wait_until("no folder is left", || place.left().is_empty());
}

#[test]
fn after_a_sound_run_no_folder_is_left() {
    let place = Place::new("");
    for name in ["check", "run"] {
        let (code, said) = place.told(name);
        assert_eq!(code, 0, "{said}");
        wait_until("no folder is left", || place.left().is_empty());
    }
}

#[test]
fn a_program_that_serves_leaves_no_folder_either() {
    let (place, folder) = (Place::new(""), kit::Folder::new());
    folder.serving("study.toml", "");
    for name in ["check", "run"] {
        let mut command = starlings();
        command.arg(name).arg(folder.path().join("study.toml")).env("TMPDIR", place.temporary());
        if name == "run" {
            command.arg("--out").arg(folder.path().join("out"));
        }
        let (code, _, stderr) = output(&mut command);
        assert_eq!(code, 0, "{stderr}");
        wait_until("no folder is left", || place.left().is_empty());
    }
}

#[test]
fn a_program_that_stops_while_it_serves_ends_with_an_interrupted_command() {
    let (place, folder) = (Place::new(""), kit::Folder::new());
    folder.serving("study.toml", "");
    let mut command = starlings()
        .arg("run")
        .arg(folder.path().join("study.toml"))
        .arg("--out")
        .arg(folder.path().join("out"))
        .env("TMPDIR", place.temporary())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let out = folder.path().join("out");
    wait_until("solvers run", || kit::groups_of(&folder.mark()).len() >= 2 && common::analyses(&out) > 5);
    let groups = kit::groups_of(&folder.mark());
    for group in &groups {
        signal("-STOP", &group.to_string());
    }
    signal("-INT", &command.id().to_string());
    gone(&groups);
    assert_eq!(command.wait().unwrap().code(), Some(130));
    wait_until("no folder is left", || place.left().is_empty());
}
