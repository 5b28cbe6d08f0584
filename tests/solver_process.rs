//! External solvers as processes: killed at random, silent, broken, and none of them left behind.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
#[path = "solver_kit/mod.rs"]
mod kit;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use common::{bytes, run, starlings};
use kit::{Folder, groups_of, kill_one};

/// Times that a solver is killed while the study runs.
const KILLS: usize = 100;

/// Kills solvers at random while a study runs, until it has ended or enough were killed; how many.
fn killing(folder: &Folder, study: &Path, out: &Path, chance: &mut u64, most: usize) -> usize {
    let over = Arc::new(AtomicBool::new(false));
    let killer = {
        let (over, mark, out, mut drawn) = (Arc::clone(&over), folder.mark(), out.to_path_buf(), *chance);
        std::thread::spawn(move || {
            common::wait_until("the run has begun", || common::analyses(&out) > 0);
            let mut killed = 0;
            while !over.load(Ordering::Relaxed) && killed < most {
                killed += usize::from(kill_one(&mark));
                // At random: sometimes a solver has only just started, sometimes it has made many runs.
                drawn = drawn.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                std::thread::sleep(Duration::from_millis(3 + (drawn >> 33) % 40));
            }
            (killed, drawn)
        })
    };
    run(study, out, 2);
    over.store(true, Ordering::Relaxed);
    let (killed, drawn) = killer.join().unwrap();
    *chance = drawn;
    killed
}

#[test]
fn a_hundred_killed_solvers_change_no_byte_and_leave_no_process() {
    let folder = Folder::new();
    folder.serving("study.toml", "");
    let quiet = folder.path().join("quiet");
    run(&folder.path().join("native.toml"), &quiet, 2);
    let (mut killed, mut chance) = (0, 1);
    // A fast machine ends a run before a hundred are killed: then in another one.
    for again in 0..20 {
        let noisy = folder.path().join(format!("noisy-{again}"));
        killed += killing(&folder, &folder.path().join("study.toml"), &noisy, &mut chance, KILLS - killed);
        assert_eq!(bytes(&quiet, "posterior.csv"), bytes(&noisy, "posterior.csv"));
        let summary: serde_json::Value = serde_json::from_slice(&bytes(&noisy, "summary.json")).unwrap();
        assert_eq!(summary["runs"]["failed"], 0, "a killed solver is no failed run");
        if killed == KILLS {
            break;
        }
    }
    assert_eq!(killed, KILLS);
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
