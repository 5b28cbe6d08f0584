//! Bad input gets one message with cause and remedy and exit code 2; a failed run exit code 1; nothing half-written is left.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod small_kit;

use std::fs;
use std::path::Path;

use common::{output, starlings};
use small_kit::{same, study, swap};

/// Runs the study and expects it to be refused with every one of `words`, and no run folder.
fn refused(file: &Path, words: &[&str]) {
    let out = file.with_file_name("out");
    common::refused(starlings().arg("run").arg(file).arg("--out").arg(&out), words);
    assert!(!out.exists(), "a refused study leaves no folder behind");
}

#[test]
fn the_small_study_itself_is_sound() {
    let (dir, file) = study(same, same);
    let summary = common::run(&file, &dir.path().join("out"), 1);
    assert_eq!(summary["study"], "small");
}

#[test]
fn an_unknown_key_names_its_line_and_the_nearest_key() {
    let (_dir, file) = study(swap("workers = 1", "wrokers = 1"), same);
    refused(&file, &["wrokers", "workers", "study.toml:26"]);
}

#[test]
fn a_wrong_type_says_what_was_expected() {
    let (_dir, file) = study(swap("name = \"R\"", "name = 3"), same);
    refused(&file, &["text in quotes", "the number 3", "study.toml:8:8"]);
}

#[test]
fn a_missing_file_is_named() {
    let (_dir, file) = study(swap("data.csv", "dada.csv"), same);
    refused(&file, &["dada.csv"]);
}

#[test]
fn a_missing_study_is_named() {
    refused(Path::new("/nonexistent/study.toml"), &["/nonexistent/study.toml"]);
}

#[test]
fn a_missing_column_offers_the_nearest() {
    let (_dir, file) = study(swap("column = \"pressure\"", "column = \"presure\""), same);
    refused(&file, &["presure", "pressure"]);
}

#[test]
fn times_that_go_back_name_both_lines() {
    let (_dir, file) = study(same, swap("0.3,102.0", "0.15,102.0"));
    refused(&file, &["data.csv", "0.15", "0.2"]);
}

#[test]
fn duplicate_times_are_called_duplicates() {
    let (_dir, file) = study(same, swap("0.3,102.0", "0.2,102.0"));
    refused(&file, &["data.csv", "duplicate"]);
}

#[test]
fn a_channel_of_only_nan_is_refused() {
    let nan = |text: String| {
        text.lines()
            .enumerate()
            .map(|(i, line)| {
                let cells: Vec<&str> = line.split(',').collect();
                if i == 0 { line.to_owned() } else { format!("{},NaN,{}", cells[0], cells[2]) }
            })
            .collect::<Vec<_>>()
            .join("\n")
    };
    let (_dir, file) = study(same, nan);
    refused(&file, &["pressure"]);
}

#[test]
fn a_prior_outside_its_bounds_is_refused() {
    let (_dir, file) = study(
        swap(
            "transform = \"log\", median = 3.0, factor = 2.0",
            "transform = \"logit(0, 2)\", median = 3.0, sd = 1.0",
        ),
        same,
    );
    refused(&file, &["3", "0", "2", "study.toml:9"]);
}

#[test]
fn a_parameter_that_the_model_lacks_offers_the_nearest() {
    let (_dir, file) = study(swap("name = \"R\"", "name = \"RR\""), same);
    refused(&file, &["RR", "`R`", "study.toml:8"]);
}

#[test]
fn an_expression_error_has_its_caret_under_the_place() {
    let equations = |text: String| {
        let head = text.replacen("kind = \"windkessel-2\"", EQUATIONS, 1);
        assert!(head.contains("equations"));
        head
    };
    let (_dir, file) = study(equations, same);
    refused(&file, &["study.toml:14:18", "sine"]);
}

const EQUATIONS: &str = r#"kind = "equations"
outputs = [ { name = "pressure", value = "p" } ]
inputs = [ { name = "flow" } ]

[[model.states]]
name = "p"
unit = "mmHg"
role = "pressure"
initial = 100.0
rate = "flow/C - sine(p)/(R*C)""#;

#[test]
fn zero_workers_are_refused() {
    let (_dir, file) = study(swap("workers = 1", "workers = 0"), same);
    refused(&file, &["workers"]);
    let (dir, file) = study(same, same);
    let out = dir.path().join("out");
    let (code, _, stderr) =
        output(starlings().arg("run").arg(&file).arg("--out").arg(&out).args(["--workers", "0"]));
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("at least 1"), "{stderr}");
}

#[test]
fn a_model_that_is_not_finite_at_the_prior_median_is_refused() {
    let (_dir, file) = study(same, same);
    let text = fs::read_to_string(&file).unwrap();
    let text = text.replacen("kind = \"windkessel-2\"", &EQUATIONS.replace("sine(p)", "p*log(0-p)"), 1);
    fs::write(&file, text).unwrap();
    refused(&file, &["prior median", "not a finite number"]);
}

#[test]
fn a_folder_that_holds_a_run_is_left_alone() {
    let (dir, file) = study(same, same);
    let out = dir.path().join("out");
    common::run(&file, &out, 1);
    let before = common::bytes(&out, "summary.json");
    let (code, _, stderr) = output(starlings().arg("run").arg(&file).arg("--out").arg(&out));
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("already holds a run") && stderr.contains("--resume"), "{stderr}");
    assert_eq!(before, common::bytes(&out, "summary.json"));
}

#[test]
fn an_unwritable_folder_is_named() {
    let (dir, file) = study(same, same);
    // A file where the folder should be: not even root can write into it.
    let blocked = dir.path().join("blocked");
    fs::write(&blocked, "").unwrap();
    let (code, _, stderr) = output(starlings().arg("run").arg(&file).arg("--out").arg(blocked.join("run")));
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("cannot write") && stderr.contains("blocked"), "{stderr}");
}

#[test]
fn a_full_disk_is_called_so() {
    if !Path::new("/dev/full").exists() {
        return;
    }
    let (_dir, file) = study(same, same);
    let (code, _, stderr) = output(starlings().arg("simulate").arg(&file).args(["-o", "/dev/full"]));
    assert_ne!(code, 0);
    assert!(stderr.contains("No space left"), "{stderr}");
}

#[test]
fn a_port_in_use_is_named_with_its_remedy() {
    let (dir, file) = study(same, same);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let out = dir.path().join("out");
    let (code, _, stderr) =
        output(starlings().arg("run").arg(&file).arg("--out").arg(&out).args(["--listen", &address]));
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains(&address) && stderr.contains("taken"), "{stderr}");
}

#[test]
fn options_of_an_address_without_one_and_proof_without_proof_are_refused() {
    let (dir, file) = study(same, same);
    let out = dir.path().join("out");
    for (options, says) in [
        (&["--insecure"][..], "--listen"),
        (&["--access", "a.json"], "--listen"),
        (&["--listen", "127.0.0.1:0", "--access", "a.json", "--insecure"], "cannot be used with"),
    ] {
        let (code, _, stderr) =
            output(starlings().arg("run").arg(&file).arg("--out").arg(&out).args(options));
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains(says), "{stderr}");
        assert!(!out.exists());
    }
}
