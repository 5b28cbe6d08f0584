//! Bad solvers as a user meets them: what the command says, with which exit code, and what stays behind.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod bad_solver_kit;
mod common;
#[path = "solver_kit/mod.rs"]
mod kit;

use std::process::Stdio;

use bad_solver_kit::{BadSolverStudy, blocking_place, gone, members, signal, workers};
use common::{output, starlings, wait_until};

#[test]
fn a_solver_that_fails_at_the_prior_median_ends_the_command_before_anything_is_made() {
    let place = BadSolverStudy::new("sys.exit('cannot read mesh.vtk')");
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
    let place = BadSolverStudy::new("if rate < 0.96: sys.exit('cannot factor the matrix')");
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
    let place =
        BadSolverStudy::new("if abs(rate - 1) > 1e-6 or abs(start - 10) > 1e-6: sys.exit('no licence left')");
    let (code, said) = place.told("run");
    assert_eq!(code, 1, "{said}");
    for words in ["particle 1, record 0 (rate = ", "no licence left", "error: "] {
        assert!(said.contains(words), "`{words}` is missing in: {said}");
    }
}

#[test]
fn an_answer_that_is_no_number_is_told_like_any_other_failure() {
    let place = BadSolverStudy::new("if rate < 0.96: excess[3] = float('nan')");
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
        let own = |place: &BadSolverStudy| {
            place.left().iter().any(|(n, _)| n.starts_with(&format!("starlings-{worker}-")))
        };
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
    let place = BadSolverStudy::new("");
    for name in ["check", "run"] {
        let (code, said) = place.told(name);
        assert_eq!(code, 0, "{said}");
        wait_until("no folder is left", || place.left().is_empty());
    }
}

#[test]
fn a_program_that_serves_leaves_no_folder_either() {
    let (place, folder) = (BadSolverStudy::new(""), kit::Folder::new());
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
    let (place, folder) = (BadSolverStudy::new(""), kit::Folder::new());
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
