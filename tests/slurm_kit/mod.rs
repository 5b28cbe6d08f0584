//! Deployments under the real Slurm that `.ci/slurm test` starts.

#![allow(clippy::unwrap_used, dead_code)] // each test uses its part

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::common::{output, repository, run, starlings};

/// A study, what it gives on local workers, and places for a deployment and a run.
pub(crate) struct Trial {
    folder: tempfile::TempDir,
    /// The study file.
    pub(crate) study: PathBuf,
}

impl Trial {
    pub(crate) fn new() -> Self {
        let trial =
            Self { folder: tempfile::tempdir().unwrap(), study: repository("examples/pig-aorta/study.toml") };
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

/// The process of a worker of a deployment.
pub(crate) fn worker_process(access: &Path, task: &str) -> Option<String> {
    std::fs::read_dir("/proc").unwrap().flatten().find_map(|entry| {
        let read = |name: &str| std::fs::read(entry.path().join(name)).unwrap_or_default();
        let has = |bytes: &[u8], word: &str| bytes.split(|b| *b == 0).any(|w| w == word.as_bytes());
        let is_it = has(&read("cmdline"), "worker")
            && has(&read("cmdline"), access.to_str().unwrap())
            && has(&read("environ"), &format!("SLURM_ARRAY_TASK_ID={task}"))
            && !has(&read("cmdline"), "/bin/bash");
        is_it.then(|| entry.file_name().into_string().unwrap())
    })
}

/// The process that started a process.
pub(crate) fn parent(pid: &str) -> String {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("PPid:")).unwrap();
    line.trim().to_owned()
}

pub(crate) fn kill(pid: &str) {
    assert!(Command::new("kill").args(["-9", pid]).status().unwrap().success());
}

/// Starts the daemon of a node again, which frees the name of the node for the next test.
pub(crate) struct Revived(pub(crate) String);

impl Drop for Revived {
    fn drop(&mut self) {
        let _ = Command::new("slurmd").args(["-N", &self.0]).status();
    }
}
