//! `starlings infer`: what is said of a recording's step, by its digits and where it is coarse for the dynamics.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use common::{output, starlings};
use infer_kit::{STUDY, folder, infer, recording, said};
use serde_json::Value;

/// Every so many rows of a recording.
fn every(n: usize, data: &str) -> String {
    let rows = data.lines().skip(1).step_by(n);
    std::iter::once("time,x,z").chain(rows).flat_map(|line| [line, "\n"]).collect()
}

fn coarse(found: &Value) -> Vec<&str> {
    said(found, "coarse for this dynamics")
}

#[test]
fn steps_that_are_coarse_for_the_dynamics_are_told_with_the_remedy_and_fine_ones_are_not() {
    // Rates of 3 per unit of time: 0.03 of their time in a step, and 0.2.
    let data = recording(400_000, usize::MAX);
    let fine = infer(folder(STUDY, &data).path(), "out", "2");
    assert_eq!(coarse(&fine), Vec::<&str>::new());
    let extrapolated = STUDY.replace("block = 300", "block = 300\nrichardson = true");
    let short = infer(folder(&extrapolated, &recording(10_000, usize::MAX)).path(), "out", "2");
    assert_eq!(said(&short, "moves coefficients far"), Vec::<&str>::new());
    let rows = every(6, &data);
    let dir = folder(STUDY, &rows);
    let found = infer(dir.path(), "out", "2");
    let told = coarse(&found);
    assert!(told.len() == 1 && told[0].starts_with("steps of 0.06 s are coarse"), "{found}");
    assert!(told[0].contains("`richardson = true` in [infer]"), "{told:?}");
    // What it asks for moves estimates towards the rates of the path and ends the warning.
    let mended = infer(folder(&extrapolated, &rows).path(), "out", "2");
    assert_eq!(coarse(&mended), Vec::<&str>::new());
    assert_eq!(said(&mended, "the extrapolation to no step moves coefficients far").len(), 1, "{mended}");
    let c = |of: &Value| of["coefficients"][1]["estimate"].as_f64().unwrap();
    let of_path = c(&fine);
    assert!((c(&mended) - of_path).abs() < 0.7 * (c(&found) - of_path).abs(), "{of_path} {mended} {found}");
}

#[test]
fn steps_so_coarse_that_longer_ones_have_no_fit_are_told_by_what_is_left_to_compare() {
    let data = recording(400_000, usize::MAX);
    let of = |every_so: usize| infer(folder(STUDY, &every(every_so, &data)).path(), "out", "1");
    // Of the rate 3 two tenths of whose time are a step: at 4 steps there is no fit, at 2 there is.
    let found = of(10);
    let told = coarse(&found);
    assert!(told.len() == 1 && told[0].contains("four times the step has no fit"), "{found}");
    assert!(told[0].contains("k by -") && told[0].contains("at least"), "{told:?}");
    // At 2 steps there is none: a step is half the fastest time of the drift.
    let found = of(15);
    let told = coarse(&found);
    assert!(told.len() == 1 && told[0].contains("a step is 0.5 times the fastest time"), "{found}");
    // At the step itself there is none.
    let dir = folder(STUDY, &every(40, &data));
    let (code, _, stderr) = output(starlings().current_dir(dir.path()).args(["infer", "study.toml"]));
    assert!(code == 2 && stderr.contains("each is too long for the dynamics"), "{code} {stderr}");
    assert!(stderr.contains("record in shorter steps"), "{stderr}");
}

#[test]
fn a_step_is_told_with_the_digits_of_the_times() {
    // The mean of these differences is 0.020000000000000018.
    let dir = folder(STUDY, &every(2, &recording(2_000, usize::MAX)));
    let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(["check", "study.toml"]));
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("steps of 0.02 s,"), "{stdout}");
    assert_eq!(infer(dir.path(), "out", "1")["step"], 0.02);
}
