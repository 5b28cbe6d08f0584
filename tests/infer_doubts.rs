//! `starlings infer`: what is said where a recording is not what its intervals take it for.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::fmt::Write as _;

use common::{output, starlings};
use infer_kit::{STUDY, by_rates, folder, infer, noise, recording, refused, said};
use serde_json::Value;

/// Mean and standard deviation of the coefficient of this name.
fn value(found: &Value, name: &str) -> [f64; 2] {
    let all = found["coefficients"].as_array().unwrap();
    let one = all.iter().find(|c| c["name"] == name).unwrap();
    ["estimate", "sd"].map(|key| one[key].as_f64().unwrap())
}

#[test]
fn errors_so_small_that_only_a_long_recording_minds_them_are_taken_out_and_told() {
    let clean = recording(200_000, usize::MAX);
    let mut noise = noise(7);
    let mut rows = clean.lines();
    let mut measured = format!("{}\n", rows.next().unwrap());
    for row in rows {
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        writeln!(measured, "{:?},{:?},{:?}", cells[0], cells[1] + 0.01 * noise(), cells[2] + 0.01 * noise())
            .unwrap();
    }
    let clean = infer(folder(STUDY, &clean).path(), "out", "2");
    assert_eq!(clean["diffusion"]["lag_corrected"], false);
    let found = infer(folder(STUDY, &measured).path(), "out", "2");
    let ratio = found["noise_checks"][0]["ratio"].as_f64().unwrap();
    assert!((0.03..0.05).contains(&ratio), "a small one: {ratio}");
    assert_eq!(found["diffusion"]["lag_corrected"], true, "{found}");
    assert_eq!(said(&found, "errors of the measurement in x").len(), 1, "{found}");
    assert_eq!(said(&found, "coarse for this dynamics").len(), 0, "{found}");
    for name in ["k", "c", "d"] {
        let ([without, sd], [with, _]) = (value(&clean, name), value(&found, name));
        assert!((with - without).abs() < sd, "{name}: {without} ± {sd} without errors, {with} with them");
    }
}

#[test]
fn coefficients_that_change_during_a_recording_are_told_and_those_that_do_not_are_not() {
    let steady = infer(folder(STUDY, &recording(20_000, usize::MAX)).path(), "out", "2");
    assert_eq!(said(&steady, "not the same throughout"), Vec::<&str>::new());
    let changed = recording(20_000, 10_000);
    let found = infer(folder(STUDY, &changed).path(), "out", "2");
    let told = said(&found, "not the same throughout: c is ");
    assert_eq!(told.len(), 1, "{found}");
    // Blocks have 300 steps and stretches at most eight blocks.
    let from = told[0].split_once("before ").unwrap().1.split(' ').next().unwrap();
    assert!((from.parse::<f64>().unwrap() - 100.0).abs() <= 12.0, "{told:?}");
    // The same bytes, however many make the sums.
    let one = infer(folder(STUDY, &changed).path(), "out", "1");
    assert_eq!(one["warnings"], found["warnings"]);
}

#[test]
fn a_prior_that_the_data_contradict_is_told() {
    let of = |mean: f64, sd: f64| {
        let prior = format!("prior = {{ transform = \"linear\", median = {mean}, sd = {sd} }}");
        let study = format!("{STUDY}\n[[parameters]]\nname = \"k\"\n{prior}\n");
        infer(folder(&study, &recording(10_000, usize::MAX)).path(), "out", "2")
    };
    assert_eq!(said(&of(2.5, 0.5), "contradict"), Vec::<&str>::new());
    assert_eq!(said(&of(-5.0, 0.3), "contradict the prior of k").len(), 1);
}

#[test]
fn what_noise_makes_of_a_coarse_step_is_told_of_a_long_recording_too() {
    // A decay of rate 5 in steps of a quarter of its time, as it moves from row to row without any error.
    let study = by_rates(&[("x", "-a*x")], r#"parameters = ["a"]"#);
    let path = |step: f64, n: usize| {
        let (mut noise, keeps) = (noise(7), (-5.0 * step).exp());
        let (mut x, mut text) = (0.0, "time,x\n".to_owned());
        for k in 0..=n {
            writeln!(text, "{:?},{x:?}", (k as f64 * step * 1e6).round() / 1e6).unwrap();
            x = keeps * x + (0.1 * (1.0 - keeps * keeps)).sqrt() * noise();
        }
        infer(folder(&study, &text).path(), "out", "2")
    };
    let found = path(0.05, 30_000);
    assert!(value(&found, "a")[0] > 5.5, "{found}");
    assert_eq!(said(&found, "coarse for this dynamics").len(), 1, "{found}");
    let fine = path(0.005, 30_000);
    assert_eq!(said(&fine, "coarse for this dynamics"), Vec::<&str>::new());
}

#[test]
fn a_table_of_other_separators_or_in_another_order_is_told_as_that() {
    let data = recording(2_000, usize::MAX);
    for (sign, name) in [("\t", "tabs"), (";", "semicolons")] {
        refused(STUDY, &data.replace(',', sign), &[&format!("separated by {name}"), "starlings init FILE"]);
    }
    let mut rows: Vec<&str> = data.lines().collect();
    rows[1..].reverse();
    refused(
        STUDY,
        &(rows.join("\n") + "\n"),
        &["later than the one before: 19.99 follows 20", "sort the rows"],
    );
}

/// A decay by its rate `a*x - b*x^3` under noise of any size, as its file.
fn bistable(size: impl Fn(f64) -> f64) -> String {
    let (mut noise, mut x, mut text) = (noise(11), 1.0_f64, "time,x\n".to_owned());
    let h: f64 = 0.002;
    for k in 0..=100_000 {
        if k % 10 == 0 {
            writeln!(text, "{:?},{x:?}", f64::from(k / 10) / 50.0).unwrap();
        }
        x += h * (x - x.powi(3)) + h.sqrt() * size(x) * noise();
    }
    text
}

#[test]
fn noise_that_depends_on_the_state_is_told_with_intervals_that_hold_and_constant_noise_is_not() {
    let study = by_rates(&[("x", "a*x - b*x^3")], r#"parameters = ["a", "b"]"#);
    let steady = infer(folder(&study, &bistable(|_| 0.6)).path(), "out", "2");
    assert_eq!(said(&steady, "not constant"), Vec::<&str>::new());
    assert_eq!((&steady["noise_varies"], &steady["robust"]), (&Value::Null, &Value::Null));
    let dir = folder(&study, &bistable(|x| 0.2 + 0.6 * x.abs()));
    let found = infer(dir.path(), "out", "2");
    let told = said(&found, "the noise is not constant: that of x is ");
    assert_eq!(told.len(), 1, "{found}");
    assert!(told[0].contains(" times as large at x = ") && told[0].contains("log(x)"), "{told:?}");
    let varies = &found["noise_varies"][0];
    let [from, to] = [0, 1].map(|k| varies["at"][k].as_f64().unwrap());
    let ratio = varies["ratio"].as_f64().unwrap() / (0.2 + 0.6 * to.abs()) * (0.2 + 0.6 * from.abs());
    assert!((0.8..1.25).contains(&ratio), "{varies}");
    assert!(found["conditional_on"].as_str().unwrap().contains("white, of any size in each step"));
    // Without what the noise moves them by they are half of that.
    for name in ["a", "b"] {
        let [estimate, sd] = value(&found, name);
        assert!((estimate - 1.0).abs() < 3.0 * sd && sd < 0.25, "{name}: {estimate} ± {sd}");
    }
    let one = infer(dir.path(), "one", "1");
    assert_eq!(one, found, "the same bytes, however many make the sums");
    let arguments = ["forecast", "out", "--until", "2010", "--members", "20", "--json"];
    let (code, forecast, stderr) = output(starlings().current_dir(dir.path()).args(arguments));
    assert_eq!(code, 0, "{stderr}");
    assert!(forecast.contains("the noise of x is not constant"), "{forecast}");
    let page = std::fs::read_to_string(dir.path().join("out/report.html")).unwrap();
    assert!(page.contains("the noise is not constant"), "the page warns too");
}
