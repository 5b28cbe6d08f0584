//! `starlings explain` from the study to the study with the effect in it, over worker processes.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use common::{bytes, kill, output, starlings, wait_until};
use rusqlite::Connection;
use serde_json::Value;

/// A two-element Windkessel of a recording that has a pressure drop at its inlet.
const STUDY: &str = r#"[study]
name = "inlet"
seed = 3

[model]
kind = "windkessel-2"

[[parameters]]
name = "R"
prior = { transform = "log", median = 3.0, factor = 2.0 }

[[parameters]]
name = "C"
prior = { transform = "log", median = 1.0, factor = 2.0 }

[[parameters]]
name = "initial:p"
prior = { transform = "linear", median = 80.0, sd = 10.0 }

[[records]]
name = "beats"
file = "beats.csv"
inputs = { flow = "flow.csv:flow" }
channels = [ { column = "pressure", output = "pressure", noise = 1.0 } ]
train = [0.0, 2.4]

[estimator]
kind = "batch"

[fleet]
workers = 1
"#;

/// The effect that the recording has and the model lacks.
const TRUTH: &str = "series-resistance";

/// A folder with the study and its recording.
fn case() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let rows = |heading: &str, n: usize, of: &dyn Fn(f64) -> f64| {
        let row = |i: usize| format!("{:.2},{}\n", 0.02 * i as f64, of(0.02 * i as f64));
        format!("{heading}\n{}", (0..n).map(row).collect::<String>())
    };
    // Half a sine for a third of every beat of 0.6 s.
    let flow =
        |t: f64| 80.0 * (std::f64::consts::PI * (t % 0.6) / 0.2).sin().max(0.0) * f64::from(t % 0.6 < 0.2);
    fs::write(dir.path().join("flow.csv"), rows("time,flow", 202, &flow)).unwrap();
    fs::write(dir.path().join("beats.csv"), rows("time,pressure", 201, &|_| 0.0)).unwrap();
    let study = dir.path().join("study.toml");
    fs::write(&study, STUDY).unwrap();
    let mut twin = starlings();
    twin.arg("simulate").arg(&study).args(["--set", "R=4", "--set", "C=0.9", "--set", "initial:p=85"]);
    twin.args(["--effect", &format!("{TRUTH}=0.2"), "--noise", "1", "--seed", "7", "-o"]);
    let data = dir.path().join("twin.csv");
    let (code, _, stderr) = output(twin.arg(&data));
    assert_eq!(code, 0, "{stderr}");
    fs::rename(data, dir.path().join("beats.csv")).unwrap();
    (dir, study)
}

fn explain(study: &Path, out: &Path) -> Command {
    let mut command = starlings();
    command.arg("explain").arg(study).arg("--out").arg(out);
    command
}

/// The explanation without what depends on the clock and on who answered.
fn timeless(mut found: Value) -> Value {
    for key in ["wall_s", "workers"] {
        found.as_object_mut().unwrap().remove(key);
    }
    found
}

fn json(text: &[u8]) -> Value {
    serde_json::from_slice(text).unwrap()
}

#[test]
fn a_missing_pressure_drop_is_named_added_and_shown() {
    let (dir, study) = case();
    let out = dir.path().join("runs/first");
    let (code, stdout, stderr) = output(&mut explain(&study, &out));
    assert_eq!(code, 0, "{stderr}");
    for stage in ["fit", "locate", "screen", "refit", "gates", "verdict", "add", "show"] {
        // One progress over all of them.
        let says = |l: &str| l.starts_with(stage) && l.contains(" runs, ") && l.contains(" %");
        assert!(stderr.lines().any(says), "no stage `{stage}` in {stderr}");
    }
    let (_, seen, _) = output(starlings().arg("watch").arg(&out).arg("--json"));
    assert_eq!(json(seen.as_bytes())["standing"]["share"], 1.0, "the folder tells it too: {seen}");
    let found = json(&bytes(&out, "explain.json"));
    let verdict = found["verdict"].as_str().unwrap();
    assert!(verdict == "named" || verdict == "tie", "{found:#}");
    let name = found["effects"][0]["name"].as_str().unwrap();
    let tied = found["tied_with"].to_string();
    assert!(name.starts_with(TRUTH) || tied.contains(TRUTH), "{name}, tied with {tied}");
    for told in [found["headline"].as_str().unwrap(), "before", "after", "explained.toml", "report.html"] {
        assert!(stdout.contains(told), "no `{told}` in {stdout}");
    }
    let held_out = found["gap"].as_array().unwrap().iter().find(|row| row["use"] == "held-out").unwrap();
    assert!(held_out["after"].as_f64().unwrap() < held_out["before"].as_f64().unwrap(), "{held_out}");

    // The study with the effect in it runs from where it stands.
    let summary = common::run(&out.join("explained.toml"), &dir.path().join("again"), 1);
    assert_eq!(summary["study"], "inlet-explained");
    let amplitude = found["effects"][0]["parameters"][0]["name"].as_str().unwrap();
    let names = summary["parameters"].as_array().unwrap();
    assert!(names.iter().any(|p| p["name"] == amplitude), "{amplitude} in {summary:#}");

    // Asked again, it answers from its database, wherever that lies.
    let before = ["explain.json", "explained.toml", "report.html"].map(|f| (f, bytes(&out, f)));
    for (file, _) in &before {
        fs::remove_file(out.join(file)).unwrap();
    }
    let (code, stdout, stderr) = output(explain(&study, &out).args(["--resume", "--json"]));
    assert_eq!(code, 0, "{stderr}");
    assert!(stderr.contains("finished already"), "{stderr}");
    assert_eq!(json(stdout.as_bytes()), found);
    let moved = dir.path().join("moved");
    fs::rename(&out, &moved).unwrap();
    for (file, _) in &before {
        fs::remove_file(moved.join(file)).unwrap();
    }
    let (code, stdout, stderr) = output(starlings().arg("report").arg(&moved).arg("--json"));
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(json(stdout.as_bytes()), found);
    for (file, text) in before {
        assert_eq!(bytes(&moved, file), text, "{file}");
    }

    // Without its last entry the folder is that of an explanation that was killed: there is nothing to write yet.
    let db = Connection::open(moved.join("run.db")).unwrap();
    assert_eq!(db.execute("DELETE FROM meta WHERE key = 'explanation'", []).unwrap(), 1);
    drop(db);
    let (code, _, stderr) = output(starlings().arg("report").arg(&moved));
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("is not finished: continue it with `starlings explain STUDY --out"), "{stderr}");
}

/// Answers that are kept so far; zero while there is no database.
fn kept(out: &Path) -> i64 {
    let flags = rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY;
    Connection::open_with_flags(out.join("run.db"), flags)
        .and_then(|db| db.query_row("SELECT count(*) FROM remembered_runs", [], |row| row.get(0)))
        .unwrap_or(0)
}

#[test]
fn a_killed_explanation_continues_to_the_same_answer() {
    let (dir, study) = case();
    let whole = dir.path().join("whole");
    let (code, stdout, stderr) = output(explain(&study, &whole).args(["--workers", "2", "--json"]));
    assert_eq!(code, 0, "{stderr}");
    let out = dir.path().join("killed");
    let mut child = explain(&study, &out)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    wait_until("ten kept runs", || kept(&out) >= 10 || child.try_wait().unwrap().is_some());
    kill(&mut child);
    let before = kept(&out);
    assert!(before >= 10, "{before}");
    let (code, resumed, stderr) = output(explain(&study, &out).args(["--resume", "--json"]));
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(timeless(json(resumed.as_bytes())), timeless(json(stdout.as_bytes())));
}

#[test]
fn a_folder_serves_one_command() {
    let (dir, study) = case();
    let out = dir.path().join("run");
    common::run(&study, &out, 1);
    let (code, _, stderr) = output(explain(&study, &out).arg("--resume"));
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("holds a run of `starlings run`"), "{stderr}");
    let (code, _, stderr) = output(&mut explain(&study, &out));
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("already holds a run"), "{stderr}");
    let taken = dir.path().join("taken");
    fs::create_dir(&taken).unwrap();
    fs::write(taken.join("explained.toml"), "mine").unwrap();
    let (code, _, stderr) = output(&mut explain(&study, &taken));
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("explained.toml") && stderr.contains("another folder"), "{stderr}");
    assert_eq!(fs::read_to_string(taken.join("explained.toml")).unwrap(), "mine");
    assert_eq!(fs::read_dir(&taken).unwrap().count(), 1, "nothing was added");
}

/// A decay whose state has noise.
const NOISY: &str = r#"[study]
name = "noisy"

[model]
kind = "equations"
outputs = [ { name = "x", value = "x" } ]
solver = { method = "heun", step = 0.02 }

[[model.states]]
name = "x"
initial = 3.0
rate = "-k*x"
noise = "0.05"

[[parameters]]
name = "k"
prior = { transform = "log", median = 1.0, factor = 2.0 }

[[records]]
name = "fall"
file = "fall.csv"
channels = [ { column = "x", output = "x", noise = 0.02 } ]
train = [0.0, 1.6]

[estimator]
kind = "batch"
"#;

#[test]
fn of_a_model_with_noise_in_its_states_it_says_where_the_drift_is_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let study = dir.path().join("study.toml");
    fs::write(&study, NOISY).unwrap();
    let row = |i: usize| format!("{:.2},{:.4}\n", 0.04 * i as f64, 3.0 * (-0.048 * i as f64).exp());
    fs::write(dir.path().join("fall.csv"), format!("time,x\n{}", (0..51).map(row).collect::<String>()))
        .unwrap();
    let out = dir.path().join("out");
    let (code, stdout, stderr) = output(explain(&study, &out).args(["--workers", "1", "--json"]));
    assert_eq!(code, 0, "{stderr}");
    let warnings = json(stdout.as_bytes())["warnings"].to_string();
    assert!(warnings.contains("[infer.candidates] by `starlings infer`"), "{warnings}");
    // The same without noise says nothing of it.
    fs::write(&study, NOISY.replace("noise = \"0.05\"\n", "")).unwrap();
    let out = dir.path().join("still");
    let (code, stdout, stderr) = output(explain(&study, &out).args(["--workers", "1", "--json"]));
    assert_eq!(code, 0, "{stderr}");
    assert!(!json(stdout.as_bytes())["warnings"].to_string().contains("infer.candidates"), "{stdout}");
}
