//! The same study gives the same bytes, whatever the number, order or death of workers and of the coordinator.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod small_kit;

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use common::{analyses, bytes, kill, repository, run, starlings, wait_until};

const STUDY: &str = "examples/pig-aorta/study.toml";

/// A coordinator that waits for workers, and the access file that it printed.
fn coordinator(study: &Path, out: &Path) -> (Child, String) {
    let mut child = starlings()
        .arg("run")
        .arg(study)
        .arg("--out")
        .arg(out)
        .args(["--listen", "127.0.0.1:0"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    let stderr = child.stderr.take().expect("piped");
    let mut lines = BufReader::new(stderr).lines().map_while(Result::ok);
    let access = lines
        .find_map(|line| line.split("--access ").nth(1).map(|a| a.trim().to_owned()))
        .expect("the coordinator says how to start a worker");
    // Keep reading, or a full pipe would stop the coordinator.
    std::thread::spawn(move || lines.for_each(drop));
    (child, access)
}

fn worker(access: &str) -> Child {
    starlings()
        .args(["worker", "--access", access, "--slots", "1", "--once"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts")
}

#[test]
fn one_two_and_four_workers_give_the_same_posterior() {
    let dir = tempfile::tempdir().unwrap();
    let study = repository(STUDY);
    let mut posteriors = [1, 2, 4].map(|workers| {
        let out = dir.path().join(workers.to_string());
        run(&study, &out, workers);
        bytes(&out, "posterior.csv")
    });
    posteriors.sort();
    assert_eq!(posteriors[0], posteriors[2]);
    assert!(posteriors[0].len() > 200);
}

#[test]
fn a_worker_killed_in_the_middle_changes_no_byte() {
    let dir = tempfile::tempdir().unwrap();
    let (study, quiet, noisy) = (repository(STUDY), dir.path().join("quiet"), dir.path().join("noisy"));
    run(&study, &quiet, 2);
    let (mut child, access) = coordinator(&study, &noisy);
    let mut victim = worker(&access);
    let mut survivor = worker(&access);
    wait_until("some analyses", || analyses(&noisy) > 60);
    kill(&mut victim);
    assert!(child.wait().unwrap().success(), "the run goes on with the other worker");
    survivor.wait().unwrap();
    assert_eq!(bytes(&quiet, "posterior.csv"), bytes(&noisy, "posterior.csv"));
    let summary: serde_json::Value = serde_json::from_slice(&bytes(&noisy, "summary.json")).unwrap();
    assert_eq!(summary["runs"]["failed"], 0, "a killed worker is no failed run");
}

#[test]
fn a_coordinator_killed_in_the_middle_resumes_to_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let (study, whole, broken) = (repository(STUDY), dir.path().join("whole"), dir.path().join("broken"));
    run(&study, &whole, 2);
    // Twice: once in the first pass and once in the second.
    for (resume, stop_at) in [(false, 200), (true, 600)] {
        let mut command = starlings();
        command.arg("run").arg(&study).arg("--out").arg(&broken).args(["--workers", "2"]);
        if resume {
            command.arg("--resume");
        }
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        wait_until("some analyses", || analyses(&broken) > stop_at);
        kill(&mut child);
        assert!(!broken.join("posterior.csv").exists(), "a killed run leaves no result behind");
    }
    let mut command = starlings();
    command.arg("run").arg(&study).arg("--out").arg(&broken).args(["--workers", "2", "--resume", "--json"]);
    let (code, _, stderr) = common::output(&mut command);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(bytes(&whole, "posterior.csv"), bytes(&broken, "posterior.csv"));
}

/// A command that the system kills when a file of it, or of a process that it started, grows beyond so many blocks of 512
/// bytes: a kill at one and the same write every time.
fn killed_beyond(blocks: u32, command: &Command) -> Command {
    let mut limited = Command::new("sh");
    limited.args(["-c", &format!("ulimit -c 0; ulimit -f {blocks}; exec \"$@\""), "sh"]);
    limited.arg(command.get_program()).args(command.get_args());
    limited
}

#[test]
fn a_run_that_is_killed_at_any_write_of_its_start_is_begun_or_continued_by_the_same_command() {
    let (dir, study) = small_kit::study(small_kit::same, small_kit::same);
    let whole = dir.path().join("whole");
    run(&study, &whole, 1);
    let (mut unfinished, mut begun) = (0, 0);
    // Page by page, until a whole run fits.
    for page in 0..100_u32 {
        let out = dir.path().join(page.to_string());
        let mut command = starlings();
        command.arg("run").arg(&study).arg("--out").arg(&out);
        let (code, _, stderr) = common::output(&mut killed_beyond(8 * page, &command));
        if code == 0 {
            assert!(unfinished > 5 && begun > 5, "{unfinished} before the store, {begun} after");
            return;
        }
        let has_store = out.join("run.db").exists();
        (unfinished, begun) = (unfinished + u32::from(!has_store), begun + u32::from(has_store));
        // Every other one without --resume, as far as there is nothing to resume.
        if page % 2 == 0 || has_store {
            command.arg("--resume");
        }
        let (code, _, said) = common::output(&mut command);
        assert_eq!(code, 0, "{page} pages: {said}\nafter: {stderr}");
        assert_eq!(bytes(&whole, "posterior.csv"), bytes(&out, "posterior.csv"), "{page} pages");
        let names = std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let left: Vec<String> =
            names.filter(|name| name.contains("unfinished") || name.contains("partial")).collect();
        assert!(left.is_empty(), "{page} pages: {left:?}");
    }
    panic!("a run needs more room than was allowed");
}
