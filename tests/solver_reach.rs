//! How solvers are reached from the command line: by which adapters, from which folder, on which cores.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
#[path = "solver_kit/mod.rs"]
mod kit;

use std::process::Stdio;

use common::{output, starlings};
use kit::{Folder, groups_of};
use starlings_solver::adapters;

/// Whether a text names every adapter that a worker has.
fn names_all(text: &str) -> bool {
    adapters().iter().all(|adapter| text.contains(adapter.name))
}

#[test]
fn studies_and_options_know_the_adapters_that_workers_have() {
    let folder = Folder::new();
    folder.serving("study.toml", "adapter = \"telepathy\"");
    let (code, _, said) = output(starlings().arg("check").arg(folder.path().join("study.toml")));
    assert!(code == 2 && said.contains("unknown adapter `telepathy`") && names_all(&said), "{said}");
    for name in adapters().iter().map(|adapter| adapter.name) {
        folder.serving("study.toml", &format!("adapter = {name:?}\ntimeout = 0"));
        let (code, _, said) = output(starlings().arg("check").arg(folder.path().join("study.toml")));
        assert!(code == 2 && !said.contains("unknown adapter"), "{said}");
    }
    let mut tried = starlings();
    tried.args(["conformance", "--solver", "true", "--adapter", "telepathy"]);
    let (code, _, said) = output(&mut tried);
    assert!(code == 2 && said.contains("telepathy") && names_all(&said), "{said}");
    let mut asked = starlings();
    asked.args(["worker", "--describe", "--solver", "true", "--adapter", "telepathy"]);
    let (code, _, said) = output(&mut asked);
    assert!(code == 2 && said.contains("telepathy") && names_all(&said), "{said}");
}

/// Cores that a process may use, as the system lists them.
fn cores_of(pid: &str) -> Option<String> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("Cpus_allowed_list:"))?;
    Some(line.split_whitespace().last()?.to_owned())
}

#[test]
fn the_solvers_of_two_local_workers_are_bound_to_cores_of_their_own() {
    let folder = Folder::new();
    folder.serving("study.toml", "pin = true");
    let out = folder.path().join("out");
    let mut coordinator = starlings()
        .arg("run")
        .arg(folder.path().join("study.toml"))
        .arg("--out")
        .arg(&out)
        .args(["--workers", "2"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let wanted = std::thread::available_parallelism().unwrap().get().min(2);
    let mut seen = Vec::new();
    common::wait_until("two solvers have cores of their own", || {
        let groups = groups_of(&folder.mark());
        let mut cores: Vec<String> = groups.iter().filter_map(|group| cores_of(&group.to_string())).collect();
        let n = cores.len();
        cores.sort();
        cores.dedup();
        seen.push((n, cores.clone()));
        let over = coordinator.try_wait().unwrap().is_some();
        assert!(!over, "the run is over, and its solvers had {seen:?}");
        n == 2 && cores.len() == wanted && cores.iter().all(|list| list.parse::<usize>().is_ok())
    });
    common::kill(&mut coordinator);
    common::wait_until("no process is left", || groups_of(&folder.mark()).is_empty());
}
