//! Runs whose states stand in a bucket of a real server: the bytes of an ordinary run, over a kill and a resume, and nothing left.
//!
//! With the feature `s3` alone, and the server that `.ci/s3` installs.
#![cfg(feature = "s3")]
#![allow(clippy::unwrap_used, clippy::print_stdout)] // a failed unwrap is a failed test; what is left out is printed

#[path = "../pieces/tests/bucket_kit/mod.rs"]
mod bucket_kit;
mod common;

use std::path::Path;
use std::process::{Command, Stdio};

use bucket_kit::Server;
use common::studies::long_tube;
use common::{analyses, bytes, kill, output, starlings, wait_until};

/// Where the states stand.
const PLACE: [&str; 2] = ["--states", "s3://states/of/a/run"];

fn run(study: &Path, out: &Path, more: &[&str]) -> Command {
    let mut command = starlings();
    command.arg("run").arg(study).arg("--out").arg(out).args(["--workers", "2", "--json"]).args(more);
    command
}

#[test]
fn states_in_a_bucket_give_the_bytes_of_an_ordinary_run_and_leave_no_object() {
    let Some(server) = Server::start() else { return };
    let dir = tempfile::tempdir().unwrap();
    let study = long_tube(dir.path(), 20);
    let [ordinary, whole, broken] = ["ordinary", "whole", "broken"].map(|name| dir.path().join(name));
    let (code, _, stderr) = output(&mut run(&study, &ordinary, &[]));
    assert_eq!(code, 0, "{stderr}");
    let (code, _, stderr) = output(run(&study, &whole, &PLACE).envs(server.environment()));
    assert_eq!(code, 0, "{stderr}");
    assert!(server.n_put() > 0, "the states went through the bucket");
    assert!(bytes(&ordinary, "posterior.csv") == bytes(&whole, "posterior.csv"));
    assert_eq!(server.n_object(), 0, "a finished run needs no state");

    let mut begun = run(&study, &broken, &PLACE);
    let begun = begun.envs(server.environment()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut coordinator = begun.spawn().unwrap();
    wait_until("some analyses", || analyses(&broken) > 3);
    kill(&mut coordinator);
    assert!(server.n_object() > 0, "the snapshot's pieces stand in the bucket");
    assert!(!broken.join("states").exists(), "and nowhere else");
    let (code, _, stderr) = output(run(&study, &broken, &["--resume"]).envs(server.environment()));
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains(&format!("begun with {}: name the same", PLACE.join(" "))), "{stderr}");
    let resumed = [&PLACE[..], &["--resume"]].concat();
    let (code, _, stderr) = output(run(&study, &broken, &resumed).envs(server.environment()));
    assert_eq!(code, 0, "{stderr}");
    assert!(bytes(&ordinary, "posterior.csv") == bytes(&broken, "posterior.csv"));
    assert_eq!(server.n_object(), 0, "a finished run needs no state");
}

#[test]
fn a_bucket_that_is_not_there_is_told_before_anything_is_run() {
    let Some(server) = Server::start() else { return };
    let dir = tempfile::tempdir().unwrap();
    let (study, out) = (long_tube(dir.path(), 20), dir.path().join("out"));
    let mut command = run(&study, &out, &["--states", "s3://nobodys/x"]);
    let (code, _, stderr) = output(command.envs(server.environment()));
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("s3://nobodys/x") && stderr.contains("AWS_ACCESS_KEY_ID"), "{stderr}");
    assert_eq!(analyses(&out), 0, "nothing was run");
}
