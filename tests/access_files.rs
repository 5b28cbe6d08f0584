//! Access files and the workers that wait for them: what each side says of itself, with the real commands.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod access_kit;
mod common;

use std::process::Command;

use access_kit::{listening, parts, worker};
use common::{analyses, output, repository, starlings, wait_until};

const RCR: &str = "examples/rcr/study.toml";

#[test]
fn a_worker_that_stays_waits_for_an_access_file_that_is_not_there_yet_and_says_what_it_does() {
    let dir = tempfile::tempdir().unwrap();
    let access = dir.path().join("pool.json");
    let name = access.to_str().unwrap();
    let (code, _, said) = output(starlings().args(["worker", "--access", name]));
    assert!(code == 2 && said.contains("there is no access file"), "{said}");
    let mut pool = worker(&access, &["--stay", "--idle", "10m"]);
    pool.await_words("there is no access file");
    let out = dir.path().join("run");
    let mut open = listening("run", &repository(RCR), &["--access", name, "--out", out.to_str().unwrap()]);
    assert_eq!(open.end(), Some(0), "{}", open.said());
    pool.await_words("the run is over: waiting for the next command");
    let _ = Command::new("kill").args(["-TERM", &pool.child.id().to_string()]).status();
    assert_eq!(pool.end(), Some(0));
    let said = pool.said();
    for words in ["dialling for up to 600 s (`--idle`", "connected to 127.0.0.1:", "ends: cancelled"] {
        assert_eq!(said.matches(words).count(), 1, "`{words}` is missing or told twice in {said}");
    }
}

#[test]
fn a_time_without_work_is_for_workers_that_stay() {
    let (code, _, said) = output(starlings().args(["worker", "--access", "none.json", "--idle", "90s"]));
    assert!(code == 2 && said.contains("--stay"), "{said}");
}

#[test]
fn an_access_file_that_cannot_be_written_is_known_before_the_run_folder_is_made() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    for (access, words) in [("none/access.json", "cannot write"), ("pool.key", "such as")] {
        let mut call = starlings();
        call.arg("run").arg(repository(RCR)).args(["--listen", "127.0.0.1:0", "--out"]).arg(&out);
        let (code, _, said) = output(call.arg("--access").arg(dir.path().join(access)));
        assert!(code == 2 && said.contains(words), "{said}");
        assert!(!out.exists(), "{access}");
    }
    // What is refused later leaves no private part behind.
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("study.toml"), "in the way").unwrap();
    let mut call = starlings();
    call.arg("run").arg(repository(RCR)).args(["--listen", "127.0.0.1:0", "--out"]).arg(&out);
    let (code, _, said) = output(call.arg("--access").arg(dir.path().join("pool.json")));
    assert_eq!(code, 2, "{said}");
    let left: Vec<_> =
        std::fs::read_dir(dir.path()).unwrap().flatten().map(|entry| entry.file_name()).collect();
    assert_eq!(left, ["run"]);
}

#[test]
fn workers_of_a_command_that_broke_off_are_told_so() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let mut open =
        listening("run", &repository("examples/pig-aorta/study.toml"), &["--out", out.to_str().unwrap()]);
    let [access, _] = parts(&out);
    let (mut leaves, mut stays) = (worker(&access, &[]), worker(&access, &["--stay"]));
    wait_until("some analyses", || analyses(&out) > 5);
    stays.await_words("connected to");
    let interrupted = Command::new("kill").args(["-INT", &open.child.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    assert_eq!(open.end(), Some(130));
    assert_eq!(leaves.end(), Some(0));
    stays.await_words("broke off before it was done");
    assert!(stays.child.try_wait().unwrap().is_none(), "{}", stays.said());
    let said = leaves.said();
    assert!(
        said.contains("ends: the command broke off before it was done") && !said.contains("is over"),
        "{said}"
    );
}
