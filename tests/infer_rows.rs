//! `starlings infer` on single rows that are wrong: values that stand apart, rows out of order; and on errors of the measurement that are given.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::fmt::Write as _;

use infer_kit::{STUDY, by_rates, folder, infer, noise, recording, refused, said};
use serde_json::Value;

/// Two coupled decays that keep apart errors of the measurement and the drift, as rows of x and y; in every state errors of this size.
fn coupled(seed: u64, n: usize, errors: f64) -> Vec<[f64; 2]> {
    let (mut noise, h, [mut x, mut y]) = (noise(seed), 0.004_f64, [0.0_f64; 2]);
    let mut rows = Vec::new();
    for k in 0..=5 * n {
        if k % 5 == 0 {
            rows.push([x + errors * noise(), y + errors * noise()]);
        }
        let [one, two] = [noise(), noise()].map(|n| 0.5 * h.sqrt() * n);
        (x, y) = (x + h * (0.8 * y - x) + one, y + h * (-0.8 * x - 0.5 * y) + two);
    }
    rows
}

/// The same as a file.
fn text(rows: &[[f64; 2]]) -> String {
    let mut text = "time,x,y\n".to_owned();
    for (k, [x, y]) in rows.iter().enumerate() {
        writeln!(text, "{:.6},{x:?},{y:?}", 0.02 * k as f64).unwrap();
    }
    text
}

fn of(rows: &[[f64; 2]], more: &str) -> Value {
    let asked = format!("parameters = [\"a\", \"b\", \"c\", \"d\"]\n{more}");
    infer(
        folder(&by_rates(&[("x", "a*x + b*y"), ("y", "c*x + d*y")], &asked), &text(rows)).path(),
        "out",
        "2",
    )
}

const OTHER: &str = "is not what neighbouring rows show";

/// Coefficients that leave the errors in the noise are biased by a large part of themselves here, and their residuals show three quarters of them.
#[test]
fn a_right_size_of_errors_is_not_called_wrong_where_they_bias_the_coefficients() {
    for seed in [1, 2, 3] {
        let rows = coupled(seed, 10_000, 0.2);
        let right = of(&rows, "measurement_noise = 0.2");
        assert_eq!(said(&right, OTHER), Vec::<&str>::new(), "seed {seed}");
        for found in [right, of(&rows, "")] {
            for check in found["noise_checks"].as_array().unwrap() {
                let sd = check["measured"].as_f64().unwrap().sqrt();
                assert!((sd - 0.2).abs() < 0.015, "seed {seed}: {sd} of 0.2 in {check}");
            }
        }
        for wrong in ["0.1", "0.4"] {
            let found = of(&rows, &format!("measurement_noise = {wrong}"));
            assert_eq!(said(&found, OTHER).len(), 1, "seed {seed}, {wrong}: {found}");
        }
    }
}

const APART: &str = "single values stand apart from all rows around them";

#[test]
fn a_value_that_stands_apart_is_told_with_its_line_and_an_inference_without_it_is_right() {
    let clean = coupled(4, 10_000, 0.0);
    for (size, row) in [(-5.0, 5_000), (30.0, 123)] {
        let mut rows = clean.clone();
        rows[row][0] += size;
        let found = of(&rows, "");
        let told = said(&found, APART);
        assert!(told.len() == 1 && told[0] == found["warnings"][0], "{found}");
        // The first line names the columns.
        let at = format!(": x in line {} of record `path` (at {} s, ", row + 2, 0.02 * row as f64);
        for words in [at.as_str(), "gaps = \"break\""] {
            assert!(told[0].contains(words), "{words}: {told:?}");
        }
        assert!(!told[0].contains("y in line"), "{told:?}");
    }
    let mut broken = clean.clone();
    broken[5_000][0] += 50.0;
    let study =
        by_rates(&[("x", "a*x + b*y"), ("y", "c*x + d*y")], "parameters = [\"a\", \"b\", \"c\", \"d\"]");
    refused(&study, &text(&broken), &["x in line 5002 of record `path`"]);
    let mut lines: Vec<String> = text(&broken).lines().map(str::to_owned).collect();
    lines.remove(5_001);
    let study = study.replace("[infer]\n", "[infer]\ngaps = \"break\"\n");
    let found = infer(folder(&study, &(lines.join("\n") + "\n")).path(), "out", "2");
    assert_eq!(found["warnings"], Value::Array(Vec::new()), "{found}");
}

/// Rows are looked through in pieces: where one ends and the next begins nothing is missed, and nothing told twice.
#[test]
fn values_that_stand_apart_are_told_once_wherever_a_long_recording_is_cut() {
    let mut rows = coupled(5, 70_000, 0.0);
    let at = [2, 65_503, 65_504, 65_535, 69_998];
    for row in at {
        rows[row][row % 2] += 3.0;
    }
    let found = of(&rows, "");
    let told = said(&found, APART);
    assert_eq!(told.len(), 1, "{found}");
    for row in &at[..4] {
        assert_eq!(told[0].matches(&format!("in line {} of", row + 2)).count(), 1, "row {row}: {told:?}");
    }
    assert!(told[0].contains(", 1 more;"), "{told:?}");
}

/// Noise of one size, and noise that grows with the state over decades.
#[test]
fn no_value_of_a_clean_recording_stands_apart() {
    for seed in 10..16 {
        assert_eq!(said(&of(&coupled(seed, 10_000, 0.0), ""), APART), Vec::<&str>::new(), "seed {seed}");
        assert_eq!(said(&of(&coupled(seed, 10_000, 0.15), ""), APART), Vec::<&str>::new(), "seed {seed}");
        let (mut noise, mut x, h, mut text) = (noise(seed), 1.0_f64, 0.002_f64, "time,x\n".to_owned());
        for k in 0..=50_000 {
            if k % 5 == 0 {
                writeln!(text, "{:.6},{x:?}", h * f64::from(k)).unwrap();
            }
            x *= (h * (0.5 - x) + 1.2 * h.sqrt() * noise()).exp();
        }
        let found = infer(
            folder(&by_rates(&[("x", "a*x - b*x^2")], "parameters = [\"a\", \"b\"]"), &text).path(),
            "out",
            "2",
        );
        assert_eq!(said(&found, APART), Vec::<&str>::new(), "seed {seed}");
    }
}

#[test]
fn errors_that_no_path_follows_and_rows_that_go_back_are_told_with_the_remedy() {
    let rows = coupled(1, 3_000, 0.0);
    let asked = "parameters = [\"a\", \"b\", \"c\", \"d\"]\nmeasurement_noise = 100.0";
    let study = by_rates(&[("x", "a*x + b*y"), ("y", "c*x + d*y")], asked);
    refused(
        &study,
        &text(&rows),
        &["standard deviation 100, measurement_noise", "neighbouring rows differ", "at most 0.7 times"],
    );
    let data = recording(2_000, usize::MAX);
    let mut lines: Vec<&str> = data.lines().collect();
    lines.swap(101, 102);
    refused(
        STUDY,
        &(lines.join("\n") + "\n"),
        &["data.csv:103: time goes back from 1.01 to 1", "sort the rows by time"],
    );
    lines.swap(101, 102);
    lines.remove(101);
    refused(STUDY, &(lines.join("\n") + "\n"), &["time jumps from 0.99 to 1.01", "gaps = \"break\""]);
}
