//! `[predict]` of a run: bands of what nobody measured in closed form, the same bytes whoever computes, solvers, and what is refused.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod swing_kit;

use std::path::{Path, PathBuf};

use common::{bytes, output, refused, run, starlings};
use nalgebra::{Matrix2, Vector2};
use serde_json::Value;
use swing_kit::{STUDY, motion};

/// What is asked for beside the estimates.
const PREDICT: &str = r#"
[predict]
outputs = ["velocity", "x"]
members = 999
step = 0.05
"#;

/// A folder with the study and its recording.
fn study(folder: &Path, text: &str) -> PathBuf {
    swing_kit::write(folder);
    let file = folder.join("study.toml");
    std::fs::write(&file, text).unwrap();
    file
}

/// The free oscillator's study with what it asks for.
fn asking() -> String {
    format!("{STUDY}{PREDICT}")
}

/// The posterior given the residuals that a run left, in its estimates and its database.
fn posterior(summary: &Value, out: &Path) -> (Vector2<f64>, Matrix2<f64>) {
    let mean = Vector2::from_fn(|j, _| summary["parameters"][j]["estimate"].as_f64().unwrap());
    let db = rusqlite::Connection::open(out.join("run.db")).unwrap();
    let sql = "SELECT value FROM meta WHERE key = 'covariance_given_residuals'";
    let text: String = db.query_row(sql, [], |row| row.get(0)).unwrap();
    let rows: Value = serde_json::from_str(&text).unwrap();
    (mean, Matrix2::from_fn(|i, j| rows[i][j].as_f64().unwrap()))
}

/// Rows of predicted.csv: output, time, median, lower and upper end.
fn rows(out: &Path) -> Vec<(String, [f64; 4])> {
    let text = String::from_utf8(bytes(out, "predicted.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let read = |row: csv::StringRecord| {
        (row[1].to_owned(), [3, 4, 5, 6].map(|i: usize| row[i].parse::<f64>().unwrap()))
    };
    rows.records().map(|row| read(row.unwrap())).collect()
}

#[test]
fn bands_of_a_velocity_that_nobody_measured_are_those_of_the_posterior() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let summary = run(&study(folder.path(), &asking()), &out, 2);
    let (mean, covariance) = posterior(&summary, &out);
    let rows = rows(&out);
    // The record's times are every second of the step's.
    assert_eq!(rows.len(), 2 * 61);
    for (output, [t, median, lo, hi]) in &rows {
        let phi = motion(*t).row(usize::from(output == "velocity")).transpose();
        let sd = (phi.transpose() * covariance * phi)[(0, 0)].sqrt();
        let z = [*median, *lo, *hi].map(|value| (value - phi.dot(&mean)) / sd);
        // Sample quantiles of 999: at the median an sd of 0.04, at the ends one of 0.085 of the sd.
        assert!(z[0].abs() < 0.2 && (z[1] + 1.96).abs() < 0.35 && (z[2] - 1.96).abs() < 0.35, "{t}: {z:?}");
    }
    let velocity = &summary["predictions"][0];
    let highest = rows.iter().filter(|row| row.0 == "velocity").map(|row| row.1[1]).fold(f64::MIN, f64::max);
    let told = velocity["highest"]["estimate"].as_f64().unwrap();
    // The highest value of every member by itself lies above that of the medians, by less than half the band.
    assert_eq!((&velocity["output"], &velocity["unit"]), (&"velocity".into(), &"m/s".into()));
    assert!((highest..highest + 0.5).contains(&told), "{told} and {highest}");
    assert!(
        summary["conditional_on"].as_str().unwrap().contains("999 runs with draws of the posterior given")
    );
    let page = String::from_utf8(bytes(&out, "report.html")).unwrap();
    assert!(
        page.contains("Predicted, measured or not") && page.contains("velocity, record swing: predicted")
    );
    one_worker_and_two_give_the_same_bytes(folder.path(), &out);
    a_forecast_shows_them_too(&out);
}

fn one_worker_and_two_give_the_same_bytes(folder: &Path, out: &Path) {
    let again = folder.join("again");
    run(&folder.join("study.toml"), &again, 1);
    assert!(bytes(out, "predicted.csv") == bytes(&again, "predicted.csv"));
    std::fs::remove_file(again.join("predicted.csv")).unwrap();
    let (code, _, stderr) = output(starlings().arg("report").arg(&again));
    assert_eq!(code, 0, "{stderr}");
    assert!(bytes(out, "predicted.csv") == bytes(&again, "predicted.csv"), "the report writes it again");
}

fn a_forecast_shows_them_too(out: &Path) {
    let (code, stdout, stderr) =
        output(starlings().arg("forecast").arg(out).args(["--members", "50", "--until", "4", "--json"]));
    assert_eq!(code, 0, "{stderr}");
    let found: Value = serde_json::from_str(&stdout).unwrap();
    let names: Vec<&str> =
        found["outputs"].as_array().unwrap().iter().map(|o| o["output"].as_str().unwrap()).collect();
    assert_eq!(names, ["position", "velocity", "x"]);
}

/// A study of a solver that gives `y` and `twice`, of which `twice` is predicted.
const LINE: &str = r#"[study]
name = "line"
[model]
kind = "solver"
adapter = "command"
command = ["python3", "line.py"]
parameters = [{ name = "slope" }]
outputs = [{ name = "y" }, { name = "twice", unit = "m" }]
[[parameters]]
name = "slope"
prior = { transform = "log", median = 1.0, factor = 2.0 }
[[records]]
name = "one"
file = "data.csv"
channels = [{ column = "y", output = "y", noise = 0.1 }]
[estimator]
kind = "batch"
[predict]
outputs = ["twice"]
members = 40
"#;

/// A folder with that solver and its recording.
fn line(folder: &Path, text: &str) -> PathBuf {
    let program = "import json, sys\nrun = json.load(sys.stdin)\nslope = run['parameters']['slope']\n\
                   print(json.dumps({'y': [slope * t for t in run['times']], 'twice': [2 * slope * t for t in run['times']]}))\n";
    std::fs::write(folder.join("line.py"), program).unwrap();
    std::fs::write(folder.join("data.csv"), "time,y\n1,2.1\n2,3.9\n3,6.05\n").unwrap();
    let file = folder.join("study.toml");
    std::fs::write(&file, text).unwrap();
    file
}

#[test]
fn a_solver_tells_any_output_that_it_describes() {
    let folder = tempfile::tempdir().unwrap();
    let file = line(folder.path(), LINE);
    let summary = run(&file, &folder.path().join("run"), 2);
    let slope = summary["parameters"][0]["estimate"].as_f64().unwrap();
    let highest = &summary["predictions"][0]["highest"];
    let ([lo, hi], estimate) = (
        [0, 1].map(|end| highest["interval95"][end].as_f64().unwrap()),
        highest["estimate"].as_f64().unwrap(),
    );
    // 6 times the slope, whose sd is 0.1 over √14: the median of forty draws is within half an sd of it, 0.08.
    assert!((estimate - 6.0 * slope).abs() < 0.1, "{estimate} for {slope}");
    assert!((0.3..1.2).contains(&(hi - lo)), "{lo} {hi}");
    let other = LINE.replace("[\"twice\"]", "[\"thrice\"]");
    std::fs::write(&file, other).unwrap();
    let told = ["no worker can give `thrice`", "did you mean `twice`?"];
    refused(starlings().arg("run").arg(&file).arg("--out").arg(folder.path().join("other")), &told);
    assert!(!folder.path().join("other").exists(), "nothing is half done");
}

#[test]
fn an_output_that_a_solver_declares_and_never_gives_is_refused_before_the_fit() {
    let folder = tempfile::tempdir().unwrap();
    let text = LINE
        .replace("{ name = \"twice\", unit = \"m\" }", "{ name = \"ghost\" }")
        .replace("\"twice\"", "\"ghost\"");
    let file = line(folder.path(), &text);
    let told =
        ["`ghost` of `[predict]` cannot be predicted", "no key `ghost`; it has twice, y", "(slope = 1)"];
    refused(starlings().arg("check").arg(&file), &told);
    refused(starlings().arg("run").arg(&file).arg("--out").arg(folder.path().join("out")), &told);
    assert!(!folder.path().join("out").exists(), "no fit was made");
}

#[test]
fn predictions_that_fail_are_told_once_and_parameters_are_not_blamed() {
    let folder = tempfile::tempdir().unwrap();
    let file = line(folder.path(), LINE);
    // Whoever asks for `twice` anywhere but at the prior median gets nothing.
    let program = std::fs::read_to_string(folder.path().join("line.py")).unwrap();
    let program = program.replace(
        "print(",
        "if 'twice' in run['outputs'] and abs(slope - 1) > 1e-9: sys.exit('none')\nprint(",
    );
    std::fs::write(folder.path().join("line.py"), program).unwrap();
    let summary = run(&file, &folder.path().join("run"), 2);
    let warnings = summary["warnings"].to_string();
    assert!(
        warnings.contains("40 of 40 runs of `[predict]` over record `one` have no prediction"),
        "{warnings}"
    );
    assert!(!warnings.contains("tells them") && !warnings.contains("runs failed with"), "{warnings}");
}

#[test]
fn what_cannot_be_predicted_is_refused_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, words) in [
        (
            "\"velocity\", \"x\"",
            "\"velocty\"",
            &["no worker can give `velocty`", "did you mean `velocity`?"][..],
        ),
        ("\"velocity\", \"x\"", "\"x\", \"x\"", &["`x` is predicted twice"]),
        ("members = 999", "members = 20", &["20 members make no band of 95 %", "at least 39"]),
        ("step = 0.05", "step = 0.0", &["`step` is 0: give a number above zero"]),
        ("step = 0.05", "step = 1e-9", &["numbers", "a longer `step`"]),
        ("outputs = [\"velocity\", \"x\"]\n", "", &["outputs"]),
        (
            "[\"velocity\", \"x\"]",
            "[]",
            &["`outputs` of [predict] names nothing", "or leave out `[predict]`"],
        ),
    ] {
        let text = asking().replace(from, to);
        assert_ne!(text, asking());
        let file = study(folder.path(), &text);
        refused(starlings().arg("run").arg(&file).arg("--out").arg(folder.path().join("out")), words);
        refused(starlings().arg("check").arg(&file), words);
    }
}
