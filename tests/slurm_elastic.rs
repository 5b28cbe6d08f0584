//! The number of workers follows the work under a real Slurm of four nodes, which `.ci/slurm test` starts: `just slurm`.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;
mod slurm_kit;

use access_kit::Started;
use common::studies::slow;
use common::{starlings, wait_until};
use serde_json::Value;
use slurm_kit::{Trial, accounts, coordinator, deploy, queue, remove, status};

/// Workers of a deployment that run, as squeue says.
fn running(out: &std::path::Path) -> usize {
    status(out)["tasks"].as_array().unwrap().iter().filter(|task| task["state"] == "running").count()
}

#[test]
#[ignore = "needs a Slurm: .ci/slurm test"]
fn a_pool_grows_with_the_queue_and_shrinks_when_the_run_is_over_and_no_byte_changes() {
    // One worker has enough to do until the watch has looked twice.
    let trial = Trial::of(|folder| slow(folder, 8));
    let (out, fit) = (trial.path("pool"), trial.path("fit"));
    let (code, said) = deploy(&trial.study, &out, &["--elastic", "1..3", "--slots", "1"]);
    assert!(code == 0 && said.contains("1 of 1 run"), "{said}");
    assert_eq!(queue().lines().count(), 1, "{}", queue());
    let accounts = || accounts(&out);
    let watch_options = ["deploy", "watch", "--every", "0.5", "--release-after", "5s"];
    let mut watch = Started::of(starlings().args(watch_options).arg(&out));
    let mut coordinator = coordinator(&trial.study, &out.join("access.json"), &fit);

    watch.await_words("2 workers added, 1 → 3");
    wait_until("three workers in the queue or running", || queue().lines().count() == 3);
    assert_eq!(coordinator.end(), Some(0), "{}", coordinator.said());
    assert!(trial.is_same(&fit));

    watch.await_words("2 workers released, 3 → 1");
    wait_until("one worker", || queue().lines().count() == 1 && running(&out) == 1);
    let events = std::fs::read_to_string(out.join("events.jsonl")).unwrap();
    let told: Vec<Value> = events.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(told.first().unwrap()["event"], "workers-added");
    assert_eq!(told.last().unwrap()["event"], "workers-released");
    // A job is written down when its node has told that it ended.
    wait_until("the accounts of the two that were released", || accounts().len() == 2);
    let before = accounts();
    assert!(before.iter().all(|job| job.state == "CANCELLED"), "two released: {before:?}");
    remove(&out);
    wait_until("the account of the last worker", || accounts().len() == 3);
    assert_eq!(watch.end(), Some(0), "{}", watch.said());
}
