//! `starlings diagnose` as a user meets it: what it writes, what `check` and `report` say, and what is refused with its place.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::fmt::Write as _;
use std::fs;

use common::{output, refused, starlings};
use serde_json::Value;
use tempfile::TempDir;

/// A reading that may drift off or step.
const STUDY: &str = r#"
[study]
name = "gauge"
time_unit = "min"

[model]
kind = "equations"
constants = { drift = 0.0, jump = 0.0, at = 5.0 }
outputs = [ { name = "reading", value = "x + drift*t + jump*step(t - at)", unit = "bar" } ]

[[model.states]]
name = "x"
initial = "level"
rate = "0"

[[parameters]]
name = "level"
unit = "bar"
prior = { transform = "linear", median = 2.0, sd = 0.5 }

[diagnose]

[[diagnose.scenarios]]
name = "drift"
parameters = [ { name = "drift", unit = "bar/min", prior = { transform = "linear", median = 0.0, sd = 0.1 } } ]

[[diagnose.scenarios]]
name = "step"
says = "the gauge was knocked"
grid = { at = [2, 4, 6, 8] }
parameters = [
  { name = "jump", unit = "bar", prior = { transform = "linear", median = 0.2, sd = 0.2 } },
  { name = "at", unit = "min", prior = { transform = "logit(0, 10)", median = 5.0, factor = 3.0 } },
]

[[records]]
name = "shift"
file = "data.csv"
channels = [ { column = "reading", output = "reading", noise = 0.05 } ]
"#;

/// Readings with noise of a linear congruential generator and a drift from the start.
fn recording(drift: f64) -> String {
    let mut state = 7_u64;
    let mut text = "time,reading\n".to_owned();
    for k in 0..200 {
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        // Twelve uniform numbers less six have a variance of one.
        let noise = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let t = 0.05 * f64::from(k);
        writeln!(text, "{t:?},{:?}", 2.3 + drift * t + 0.05 * noise).unwrap();
    }
    text
}

fn case(study: &str, drift: f64) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("study.toml"), study).unwrap();
    fs::write(dir.path().join("data.csv"), recording(drift)).unwrap();
    dir
}

fn diagnose(dir: &TempDir, out: &str, workers: &str) -> Value {
    let arguments = ["diagnose", "study.toml", "--out", out, "--workers", workers, "--json"];
    let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(arguments));
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).expect("--json prints JSON and nothing else")
}

#[test]
fn a_drift_is_named_with_the_same_bytes_from_one_worker_and_three() {
    let dir = case(STUDY, 0.03);
    let found = diagnose(&dir, "one", "1");
    assert_eq!(found["verdict"], "named", "{found}");
    assert_eq!(found["named"], serde_json::json!(["drift"]));
    let says = found["says"].as_str().unwrap();
    assert!(
        says.contains("a fault, seen in `reading` of `shift` at")
            && says.contains("`drift` with probability"),
        "{says}"
    );
    let drift = found["scenarios"][0]["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .find(|p| p["is_severity"] == true)
        .unwrap();
    let (estimate, sd) = (drift["estimate"].as_f64().unwrap(), drift["sd"].as_f64().unwrap());
    assert!((estimate - 0.03).abs() < 4.0 * sd && sd < 0.002, "{drift}");
    diagnose(&dir, "three", "3");
    for file in ["diagnose.json", "scenarios.csv", "report.html", "study.toml"] {
        let of = |out: &str| fs::read(dir.path().join(out).join(file)).unwrap();
        assert_eq!(of("one"), of("three"), "{file}");
    }
    // The files again from the result.
    let page = fs::read(dir.path().join("one/report.html")).unwrap();
    fs::remove_file(dir.path().join("one/report.html")).unwrap();
    let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(["report", "one"]));
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("drift") && stdout.contains("probability"), "{stdout}");
    assert_eq!(fs::read(dir.path().join("one/report.html")).unwrap(), page);
    let again = ["diagnose", "study.toml", "--out", "one"];
    refused(starlings().current_dir(dir.path()).args(again), &["holds a result already"]);
}

#[test]
fn a_reading_without_a_fault_has_none() {
    let found = diagnose(&case(STUDY, 0.0), "out", "1");
    assert_eq!((&found["verdict"], &found["named"]), (&"no-fault".into(), &serde_json::json!([])), "{found}");
    assert!(found["says"].as_str().unwrap().contains("no fault"), "{found}");
}

#[test]
fn check_says_what_would_be_compared_and_runs_nothing() {
    let dir = case(STUDY, 0.0);
    let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(["check", "study.toml"]));
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stdout.contains("scenario  drift: drift")
            && stdout.contains("scenario  step: jump, at, from 4 starts"),
        "{stdout}"
    );
    let (code, stdout, _) =
        output(starlings().current_dir(dir.path()).args(["check", "study.toml", "--json"]));
    let found: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, &found["scenarios"][1]["starts"]), (0, &4.into()));
}

#[test]
fn what_makes_no_diagnosis_is_refused_with_its_place_and_a_remedy() {
    let cases: [(&str, &str, &[&str]); 13] = [
        (
            "[diagnose]\n",
            "[diagnose]\nfalse_alarm = 1.5\n",
            &["study.toml:22", "above 0 and at most 0.5, found 1.5"],
        ),
        ("[diagnose]\n", "[diagnose]\nfalse = 0.1\n", &["unknown key `false` in [diagnose]"]),
        ("name = \"step\"", "name = \"drift\"", &["two scenarios are named `drift`"]),
        ("grid = { at =", "grid = { att =", &["no parameter `att`", "did you mean `at`?"]),
        ("at = [2, 4, 6, 8]", "at = []", &["has no value"]),
        ("at = [2, 4, 6, 8]", "at = [2, 11]", &["cannot start at 11", "inside the prior's bounds"]),
        (
            "{ name = \"drift\", unit",
            "{ name = \"drifts\", unit",
            &["has no parameter `drifts`", "did you mean `drift`?"],
        ),
        ("name = \"drift\"\n", "name = \"drift\"\nweight = 0\n", &["`weight` must be above zero"]),
        (
            "name = \"drift\"\n",
            "name = \"drift\"\nset = { level = 1.0 }\n",
            &["`level` is both a constant and an estimated parameter"],
        ),
        ("name = \"drift\"\n", "name = \"drift\"\ninputs = { flow = \"reading\" }\n", &["flow"]),
        ("sd = 0.1 }", "sd = -0.1 }", &["`sd` must be above zero, found -0.1"]),
        ("sd = 0.1 } }", "sd = 0.1 }, per_record = true }", &["one value for all records"]),
        ("file = \"data.csv\"", "file = \"date.csv\"", &["date.csv", "did you mean `data.csv`?"]),
    ];
    for (from, to, words) in cases {
        assert!(STUDY.contains(from), "{from}");
        let dir = case(&STUDY.replacen(from, to, 1), 0.0);
        for command in ["diagnose", "check"] {
            refused(starlings().current_dir(dir.path()).args([command, "study.toml"]), words);
        }
        assert!(!dir.path().join("runs").exists(), "no folder of what was refused");
    }
    let without = case(&STUDY[..STUDY.find("[diagnose]").unwrap()], 0.0);
    refused(
        starlings().current_dir(without.path()).args(["diagnose", "study.toml"]),
        &["does not say what a fault may be"],
    );
    let empty = STUDY.replace("[[diagnose.scenarios]]", "[[effects]]");
    let dir = case(&empty, 0.0);
    refused(starlings().current_dir(dir.path()).args(["diagnose", "study.toml"]), &["unknown key"]);
    let broken = case(&STUDY.replace("initial = \"level\"", "initial = \"log(-level)\""), 0.0);
    refused(
        starlings().current_dir(broken.path()).args(["diagnose", "study.toml", "--workers", "1"]),
        &["the model without a fault"],
    );
}
