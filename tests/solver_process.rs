//! External solvers as processes: killed at random, silent, broken, and none of them left behind.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
#[path = "solver_kit/mod.rs"]
mod kit;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use common::{bytes, run, starlings};
use kit::{Folder, groups_of, kill_one};

/// Times that a solver is killed while the study runs.
const KILLS: usize = 100;

#[test]
fn a_hundred_killed_solvers_change_no_byte_and_leave_no_process() {
    let folder = Folder::new();
    folder.serving("study.toml", "");
    let (quiet, noisy) = (folder.path().join("quiet"), folder.path().join("noisy"));
    run(&folder.path().join("native.toml"), &quiet, 2);
    let (over, killed) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
    let killer = {
        let (over, killed, mark) = (Arc::clone(&over), Arc::clone(&killed), folder.mark());
        let out = noisy.clone();
        std::thread::spawn(move || {
            let mut chance: u64 = 1;
            common::wait_until("the run has begun", || common::analyses(&out) > 0);
            while !over.load(Ordering::Relaxed) && killed.load(Ordering::Relaxed) < KILLS {
                if kill_one(&mark) {
                    killed.fetch_add(1, Ordering::Relaxed);
                }
                // At random: sometimes a solver has only just started, sometimes it has made many runs.
                chance =
                    chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                std::thread::sleep(Duration::from_millis(3 + (chance >> 33) % 40));
            }
        })
    };
    run(&folder.path().join("study.toml"), &noisy, 2);
    over.store(true, Ordering::Relaxed);
    killer.join().unwrap();
    assert_eq!(killed.load(Ordering::Relaxed), KILLS, "the run lasts longer than the killing");
    assert_eq!(bytes(&quiet, "posterior.csv"), bytes(&noisy, "posterior.csv"));
    let summary: serde_json::Value = serde_json::from_slice(&bytes(&noisy, "summary.json")).unwrap();
    assert_eq!(summary["runs"]["failed"], 0, "a killed solver is no failed run");
    assert_eq!(groups_of(&folder.mark()), Vec::<i32>::new(), "no process is left");
}

#[test]
fn a_killed_worker_leaves_no_solver() {
    let folder = Folder::new();
    folder.serving("study.toml", "");
    let out = folder.path().join("out");
    let mut coordinator = starlings()
        .arg("run")
        .arg(folder.path().join("study.toml"))
        .arg("--out")
        .arg(&out)
        .args(["--workers", "1"])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    common::wait_until("a solver runs", || {
        !groups_of(&folder.mark()).is_empty() && common::analyses(&out) > 5
    });
    // The coordinator dies, its worker with it, and with that the solver.
    common::kill(&mut coordinator);
    common::wait_until("no process is left", || groups_of(&folder.mark()).is_empty());
}

#[test]
fn what_is_wrong_with_a_solver_is_said_once_with_the_end_of_its_output() {
    let folder = Folder::new();
    let cases: [(&str, &str, &[&str]); 6] = [
        (
            "print('cannot read mesh.vtk'); raise SystemExit(3)",
            "",
            &["exited with status 3 before it was ready", "cannot read mesh.vtk"],
        ),
        (
            "import time; time.sleep(600)",
            "start_timeout = 0.5",
            &["was not ready within 0.5 s", "must serve solver.proto"],
        ),
        (
            "import sys; sys.stderr.write('x'*10 + chr(10)); sys.exit(0)",
            "",
            &["exited with status 0 before it was ready", "xxxxxxxxxx"],
        ),
        ("x = [0]*10**9", "memory = \"200 MiB\"", &["before it was ready", "MemoryError"]),
        (
            "import os, subprocess, sys; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)', sys.argv[1]]); os._exit(1)",
            "",
            &["exited with status 1 before it was ready"],
        ),
        ("import os; os.kill(os.getpid(), 11)", "", &["was ended by signal 11 before it was ready"]),
    ];
    for (script, settings, wanted) in cases {
        folder.python("study.toml", script, settings);
        let output = starlings().arg("check").arg(folder.path().join("study.toml")).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).replace(['│', '\n'], " ");
        let said: String = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(output.status.code(), Some(2), "{said}");
        for words in wanted {
            assert!(said.contains(words), "`{words}` is missing in: {said}");
        }
    }
    assert_eq!(groups_of(&folder.mark()), Vec::<i32>::new(), "no child of a solver is left");
}
