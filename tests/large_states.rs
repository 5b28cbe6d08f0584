//! States that are too large for a message, with processes: killed coordinators and workers change no byte and leave nothing.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use common::studies::long_tube;
use common::{analyses, bytes, kill, output, repository, starlings, wait_until};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::store::Purpose;
use starlings_coordinator::study::{RunContext, RunFolder, Study, run as study_run};

fn run(study: &Path, out: &Path, more: &[&str]) -> Command {
    let mut command = starlings();
    command.arg("run").arg(study).arg("--out").arg(out).args(["--workers", "2", "--json"]).args(more);
    command
}

#[test]
fn a_coordinator_killed_with_large_states_resumes_to_the_same_bytes_and_leaves_none_of_them() {
    let dir = tempfile::tempdir().unwrap();
    let (study, whole, broken) =
        (long_tube(dir.path(), 80), dir.path().join("whole"), dir.path().join("broken"));
    let (code, _, stderr) = output(&mut run(&study, &whole, &[]));
    assert_eq!(code, 0, "{stderr}");
    assert!(!whole.join("states").exists());
    for (more, stop_at) in [(&["--state-memory", "1 MB"][..], 3), (&["--resume"], 12)] {
        let mut child =
            run(&study, &broken, more).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        wait_until("some analyses", || analyses(&broken) > stop_at);
        kill(&mut child);
        let pieces = std::fs::read_dir(broken.join("states")).unwrap().count();
        assert!(pieces > 0, "the snapshot's pieces stand in the folder");
    }
    let (code, _, stderr) = output(&mut run(&study, &broken, &["--resume", "--state-memory", "0 MB"]));
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(bytes(&whole, "posterior.csv"), bytes(&broken, "posterior.csv"));
    assert!(!broken.join("states").exists(), "a finished run needs no state");
}

/// Names of what is in the folder that machines share: a folder for each run, with a file for each piece.
fn shared(place: &Path) -> Vec<PathBuf> {
    let inside = |path: &Path| std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
    inside(place).flat_map(|run| inside(&run).collect::<Vec<_>>()).collect()
}

/// Kills a process that this one started.
fn kill_a_worker(coordinator: u32) {
    let tasks = std::fs::read_dir(format!("/proc/{coordinator}/task")).unwrap();
    let started = |task: PathBuf| std::fs::read_to_string(task.join("children")).unwrap_or_default();
    let all: String = tasks.flatten().map(|task| started(task.path())).collect();
    let worker = all.split_whitespace().next().expect("it has workers");
    assert!(Command::new("kill").args(["-9", worker]).status().unwrap().success());
}

#[test]
fn states_in_a_shared_folder_give_the_same_bytes_over_kills_of_workers_and_of_the_coordinator() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("shared");
    std::fs::create_dir(&place).unwrap();
    let (study, whole, broken) =
        (long_tube(dir.path(), 80), dir.path().join("whole"), dir.path().join("broken"));
    let (code, _, stderr) = output(&mut run(&study, &whole, &[]));
    assert_eq!(code, 0, "{stderr}");
    let named = ["--states", place.to_str().unwrap()];
    for (more, stop_at) in [(&[][..], 3), (&["--resume"], 12)] {
        let mut command = run(&study, &broken, &[&named, more].concat());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        wait_until("an analysis more", || analyses(&broken) > stop_at - 2);
        // Whatever it does just now, a run or a block.
        kill_a_worker(child.id());
        wait_until("some analyses", || analyses(&broken) > stop_at);
        kill(&mut child);
        assert!(!shared(&place).is_empty(), "the snapshot's pieces stand in the folder");
        assert!(!broken.join("states").exists(), "and nowhere else");
    }
    let (code, _, stderr) = output(&mut run(&study, &broken, &[&named, &["--resume"][..]].concat()));
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(bytes(&whole, "posterior.csv"), bytes(&broken, "posterior.csv"));
    assert_eq!(std::fs::read_dir(&place).unwrap().count(), 0, "a finished run needs no state");
}

#[test]
fn a_resume_without_the_shared_folder_of_its_states_says_what_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let place = dir.path().join("shared");
    let (study, out) = (long_tube(dir.path(), 80), dir.path().join("out"));
    let named = ["--states", place.to_str().unwrap()];
    let mut child = run(&study, &out, &named).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    wait_until("some analyses", || analyses(&out) > 3);
    kill(&mut child);
    let (code, _, stderr) = output(&mut run(&study, &out, &["--resume"]));
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("of a particle's state is missing: expected the file"), "{stderr}");
    let remedy = format!("begun with --states {}: name the same folder again", place.display());
    assert!(stderr.contains(&remedy), "{stderr}");
    for wrong in ["s3://bucket/states", ""] {
        let (code, _, stderr) = output(&mut run(&study, &out, &["--resume", "--states", wrong]));
        assert_eq!(code, 2, "{stderr}");
    }
    // A folder that refuses is noticed before anything is run.
    let file = dir.path().join("file");
    std::fs::write(&file, "no folder").unwrap();
    let (code, _, stderr) = output(&mut run(&study, &out, &["--resume", "--states", file.to_str().unwrap()]));
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("for the states of particles"), "{stderr}");
}

#[test]
fn check_says_how_large_states_are_and_whether_a_folder_takes_them() {
    let dir = tempfile::tempdir().unwrap();
    let study = long_tube(dir.path(), 80);
    let place = dir.path().join("shared");
    let check = |place: &Path| output(starlings().arg("check").arg(&study).arg("--states").arg(place));
    let (code, stdout, stderr) = check(&place);
    assert_eq!(code, 0, "{stderr}");
    // 40 001 numbers; three for each of three particles.
    assert!(
        stdout.contains("a state has 312.508 KiB") && stdout.contains("holds 2.747 MiB of them"),
        "{stdout}"
    );
    assert_eq!(std::fs::read_dir(&place).unwrap().count(), 0, "what was tried leaves nothing");
    let file = dir.path().join("file");
    std::fs::write(&file, "no folder").unwrap();
    let (code, _, stderr) = check(&file);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("for the states of particles") && stderr.contains("file"), "{stderr}");
}

/// The posterior of a study whose runs are made on threads of this process, where no state travels.
fn in_this_process(study: &Path, out: &Path) -> Vec<u8> {
    let study = Study::load(study).unwrap();
    let mut folder = RunFolder::create(Purpose::Run, out, &study, "test", "today").unwrap();
    let mut context =
        RunContext { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0, threads: 2 };
    study_run::run(&study, &mut InProcess::new(2), &mut folder, &mut context).unwrap();
    folder.store.meta("posterior").unwrap().unwrap().into_bytes()
}

/// Runs a study in every way in which its states can go, and compares with the run in which they go nowhere.
fn every_way_gives_the_same_bytes(study: &Path) {
    let dir = tempfile::tempdir().unwrap();
    let small = in_this_process(study, &dir.path().join("small"));
    let place = dir.path().join("shared");
    for (name, more) in [
        ("descriptors", &[][..]),
        ("one-descriptor", &["--state-memory", "9 MB"]),
        ("pieces", &["--state-memory", "0 MB"]),
        ("shared", &["--states", place.to_str().unwrap()]),
    ] {
        let out = dir.path().join(name);
        let (code, _, stderr) = output(&mut run(study, &out, more));
        assert_eq!(code, 0, "{name}: {stderr}");
        assert!(bytes(&out, "posterior.csv") == small, "{name}");
    }
}

#[test]
fn states_by_descriptors_in_pieces_and_in_a_folder_give_the_bytes_of_a_run_in_one_process() {
    let dir = tempfile::tempdir().unwrap();
    every_way_gives_the_same_bytes(&long_tube(dir.path(), 20));
}

#[test]
#[ignore = "half a million rings, five times: `just large-states`"]
fn the_finest_tube_gives_the_same_bytes_whichever_way_its_states_of_8_mb_go() {
    let dir = tempfile::tempdir().unwrap();
    for file in ["finest.toml", "flow.csv", "pressure.csv"] {
        std::fs::copy(repository("examples/fine-tube").join(file), dir.path().join(file)).unwrap();
    }
    // One pass shows the ways as well as four.
    let study = dir.path().join("finest.toml");
    let text = std::fs::read_to_string(&study).unwrap();
    std::fs::write(&study, text.replace("[estimator]", "[estimator]\npasses = 1")).unwrap();
    every_way_gives_the_same_bytes(&study);
}

#[test]
fn a_resume_without_a_piece_of_its_states_says_which() {
    let dir = tempfile::tempdir().unwrap();
    let (study, out) = (long_tube(dir.path(), 80), dir.path().join("out"));
    let mut child = run(&study, &out, &[]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    wait_until("some analyses", || analyses(&out) > 3);
    kill(&mut child);
    for piece in std::fs::read_dir(out.join("states")).unwrap() {
        std::fs::remove_file(piece.unwrap().path()).unwrap();
    }
    let (code, _, stderr) = output(&mut run(&study, &out, &["--resume"]));
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("of a particle's state is missing: expected the file"), "{stderr}");
}

#[test]
fn an_amount_of_memory_that_is_none_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    for amount in ["much", "8", "-1 GB", "1 XB"] {
        let out = dir.path().join("out");
        let (code, _, stderr) =
            output(&mut run(&long_tube(dir.path(), 80), &out, &[&format!("--state-memory={amount}")]));
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains("such as \"8 GiB\""), "{stderr}");
    }
}
