//! Progress of commands whose work has stages: the same words as those of a run, and none of them with `--json`.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;
mod small_kit;

use std::path::Path;
use std::process::Command;

use common::{output, starlings};
use infer_kit::{STUDY, folder, recording};
use serde_json::Value;
use small_kit::{same, study};

/// Runs a command as a person off a terminal does, and as a program does.
fn both(call: impl Fn() -> Command, line: &[&str]) {
    let (code, _, stderr) = output(&mut call());
    assert_eq!(code, 0, "{stderr}");
    let is_told = |told: &str| line.iter().all(|word| told.contains(word)) && told.contains(" %");
    assert!(stderr.lines().any(is_told), "no line with {line:?} in {stderr}");
    let (code, stdout, stderr) = output(call().arg("--json"));
    assert_eq!(code, 0, "{stderr}");
    assert!(serde_json::from_str::<Value>(&stdout).is_ok(), "{stdout}");
    assert!(!stderr.lines().any(is_told), "{stderr}");
}

fn command(words: &[&str], file: &Path) -> Command {
    let mut call = starlings();
    call.args(words).arg(file).args(["--workers", "1"]);
    call
}

#[test]
fn identify_and_forecast_tell_what_is_done_and_how_much_of_it() {
    let (dir, file) = study(same, same);
    both(|| command(&["identify"], &file), &["sensitivities: 2 parameters moved, ", " runs, "]);
    let out = dir.path().join("out");
    common::run(&file, &out, 1);
    both(|| command(&["forecast"], &out), &["ensemble: 200 members, ", " runs, ", " workers, 0 %"]);
}

#[test]
fn an_inference_tells_steps_of_about_how_many_and_rounds_of_smoothing() {
    let dir = folder(STUDY, &recording(5000, usize::MAX));
    let study = dir.path().join("study.toml");
    let out = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let infer = |name: &str| command(&["infer", "--out", &out(name)], &study);
    let (_, _, stderr) = output(&mut infer("one"));
    assert!(stderr.contains("sums: 0 of about "), "{stderr}");
    assert!(
        stderr.lines().any(|l| l.starts_with("posterior, ") && l.contains(" blocks, 1 workers, 100 %")),
        "{stderr}"
    );
    let (_, _, stderr) = output(infer("two").args(["--log", "json"]));
    let told: Vec<Value> = stderr.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let sums = told.iter().map(|record| &record["fields"]).find(|fields| fields["stage"] == "sums").unwrap();
    assert!(sums["blocks"].is_u64() && sums["share"].is_f64(), "{sums}");
    let smoothed = STUDY.replace("block = 300", "measurement_noise = 0.02");
    std::fs::write(&study, smoothed).unwrap();
    let (code, _, stderr) = output(&mut infer("three"));
    assert_eq!(code, 0, "{stderr}");
    assert!(stderr.contains("smoothing: round 1 of about "), "{stderr}");
}
