//! Deployments under the real Slurm that `.ci/slurm test` starts. What happens to its nodes: `nodes.rs`.

#![allow(clippy::unwrap_used, dead_code)] // each test uses its part

pub(crate) mod nodes;

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::access_kit::Started;
use crate::common::{output, repository, run, starlings};

/// A study, what it gives on local workers, and places for a deployment and a run.
pub(crate) struct Trial {
    folder: tempfile::TempDir,
    /// The study file.
    pub(crate) study: PathBuf,
}

impl Trial {
    pub(crate) fn new() -> Self {
        Self::of(|_| repository("examples/pig-aorta/study.toml"))
    }

    /// Of a study that is written into a folder.
    pub(crate) fn of(study: impl FnOnce(&Path) -> PathBuf) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let trial = Self { study: study(folder.path()), folder };
        run(&trial.study, &trial.path("alone"), 2);
        trial
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Whether a run folder has the posterior of local workers, to the last byte.
    pub(crate) fn is_same(&self, out: &Path) -> bool {
        let posterior = |out: &Path| std::fs::read(out.join("posterior.csv")).unwrap();
        posterior(out) == posterior(&self.path("alone"))
    }
}

/// Folder of the Slurm under test.
pub(crate) fn lab() -> PathBuf {
    PathBuf::from(std::env::var_os("SLURM_LAB").expect("started by .ci/slurm test"))
}

/// Deploys under Slurm: exit code and everything that was said.
pub(crate) fn deploy(study: &Path, out: &Path, options: &[&str]) -> (i32, String) {
    let mut command = starlings();
    command.args(["deploy", "slurm"]).arg(study).arg("--out").arg(out).args(options);
    let (code, stdout, stderr) = output(&mut command);
    (code, stdout + &stderr)
}

pub(crate) fn status(out: &Path) -> Value {
    let (code, stdout, stderr) = output(starlings().args(["deploy", "status", "--json"]).arg(out));
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).expect("--json prints JSON and nothing else")
}

/// A task of a deployment.
pub(crate) fn task(out: &Path, name: &str) -> Value {
    let status = status(out);
    status["tasks"].as_array().unwrap().iter().find(|task| task["task"] == name).unwrap().clone()
}

/// Jobs of everybody in the queue, a line each.
pub(crate) fn queue() -> String {
    output(Command::new("squeue").args(["--noheader", "--array"])).1
}

pub(crate) fn remove(out: &Path) {
    let (code, stdout, stderr) = output(starlings().args(["deploy", "remove"]).arg(out));
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("nothing is left"), "{stdout}");
    assert_eq!(queue(), "", "nothing is left in the queue");
}

/// Starts a run to which the workers of a deployment come.
pub(crate) fn coordinator(study: &Path, access: &Path, out: &Path) -> Started {
    let address = std::env::var("SLURM_LAB_ADDRESS").expect("started by .ci/slurm test");
    let mut call = starlings();
    call.arg("run").arg(study).args(["--listen", &format!("{address}:0"), "--access"]).arg(access);
    Started::of(call.arg("--out").arg(out))
}

/// The node on which a task of a deployment runs.
pub(crate) fn node_of(out: &Path, task_name: &str) -> String {
    task(out, task_name)["node"].as_str().unwrap().to_owned()
}

/// A job that has ended, as `sacct --completion` tells it.
#[derive(Debug)]
pub(crate) struct Account {
    pub(crate) state: String,
}

/// The jobs of a deployment that have ended.
pub(crate) fn accounts(out: &Path) -> Vec<Account> {
    let text = std::fs::read_to_string(out.join("deployment.json")).unwrap();
    let deployment: Value = serde_json::from_str(&text).unwrap();
    let name = deployment["name"].as_str().unwrap();
    let mut sacct = Command::new("sacct");
    sacct.args(["--completion", "--noheader", "--parsable2", "--format", "jobname,state", "--file"]);
    let (code, told, said) = output(sacct.arg(lab().join("log/completed")));
    assert_eq!(code, 0, "{said}");
    let ended = told.lines().filter_map(|line| line.split_once('|')).filter(|(job, _)| *job == name);
    ended.map(|(_, state)| Account { state: state.to_owned() }).collect()
}

/// The processes of the workers of a deployment.
pub(crate) fn workers(access: &Path) -> Vec<String> {
    let processes = std::fs::read_dir("/proc").unwrap().flatten();
    let of_access = processes.filter(|entry| {
        let line = std::fs::read(entry.path().join("cmdline")).unwrap_or_default();
        let has = |word: &str| line.split(|b| *b == 0).any(|w| w == word.as_bytes());
        has("worker") && has(access.to_str().unwrap()) && !has("/bin/bash")
    });
    of_access.map(|entry| entry.file_name().into_string().unwrap()).collect()
}

/// The process of a worker of a deployment.
pub(crate) fn worker_process(access: &Path, task: &str) -> Option<String> {
    let own = format!("SLURM_ARRAY_TASK_ID={task}");
    workers(access).into_iter().find(|pid| {
        let environment = std::fs::read(format!("/proc/{pid}/environ")).unwrap_or_default();
        environment.split(|b| *b == 0).any(|variable| variable == own.as_bytes())
    })
}

/// Whether a process is there and has not ended.
pub(crate) fn is_alive(pid: &str) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    status.lines().any(|line| line.starts_with("State:") && !line.contains("zombie"))
}
