//! `starlings forecast` from an inference: its bands hold what comes next, the same bytes whoever computes, a running inference, refusals.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use common::{bytes, output, starlings};
use infer_kit::{STUDY, folder, followed, infer, recording};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

/// Two coupled decays with noise that they share, integrated by Euler's method in steps of a tenth of a row.
fn twin(seed: u64, n: usize) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (h, mut x, mut z) = (0.001_f64, 0.0_f64, 0.0_f64);
    let mut text = "time,x,z\n".to_owned();
    for k in 0..=n {
        writeln!(text, "{:?},{x:?},{z:?}", k as f64 / 100.0).unwrap();
        for _ in 0..10 {
            let (first, second) = (h.sqrt() * normal(), h.sqrt() * normal());
            let (dx, dz) = (-2.0 * x + 3.0 * z, -3.0 * x - z);
            (x, z) = (x + h * dx + 0.5 * first, z + h * dz + 0.3 * first + 0.4 * second);
        }
    }
    text
}

/// The study with recordings that are inferred from up to 20.
fn trained() -> String {
    STUDY.replace("file = \"data.csv\"", "file = \"data.csv\"\ntrain = [0.0, 20.0]")
}

fn forecast(dir: &Path, extra: &[&str]) -> (i32, String, String) {
    output(starlings().current_dir(dir).arg("forecast").args(extra))
}

/// Shares of held-out values of x and z within the 90 % band, 0.3, 1 and 2 after the last row that was inferred from.
fn shares(study: &str, n_twin: u64) -> f64 {
    let (mut held, mut all) = (0_u32, 0_u32);
    for seed in 0..n_twin {
        let dir = folder(study, &twin(seed, 2_200));
        infer(dir.path(), "out", "1");
        let (code, _, stderr) = forecast(dir.path(), &["out", "--members", "200", "--workers", "1"]);
        assert_eq!(code, 0, "{stderr}");
        let truth = twin(seed, 2_200);
        let truth: Vec<Vec<f64>> =
            truth.lines().skip(1).map(|row| row.split(',').map(|v| v.parse().unwrap()).collect()).collect();
        let fan = String::from_utf8(bytes(&dir.path().join("out/forecast"), "fan.csv")).unwrap();
        let mut rows = csv::Reader::from_reader(fan.as_bytes());
        let names = rows.headers().unwrap().clone();
        let at = |name: &str| names.iter().position(|n| n == name).unwrap();
        let (lo, hi) = (at("q0.05"), at("q0.95"));
        for row in rows.records() {
            let row = row.unwrap();
            let time: f64 = row[2].parse().unwrap();
            let Some(column) = ["x", "z"].iter().position(|name| row[0] == **name && &row[1] == "quantity")
            else {
                continue;
            };
            if ![20.3, 21.0, 22.0].iter().any(|t| (t - time).abs() < 1e-6) {
                continue;
            }
            let value = truth.iter().find(|row| (row[0] - time).abs() < 1e-6).unwrap()[1 + column];
            let [lo, hi] = [lo, hi].map(|k| row[k].parse::<f64>().unwrap());
            held += u32::from(lo <= value && value <= hi);
            all += 1;
        }
    }
    assert_eq!(u64::from(all), 6 * n_twin);
    f64::from(held) / f64::from(all)
}

#[test]
fn nine_values_in_ten_of_what_comes_next_are_in_the_band() {
    // 60 twins of six values, of which x and z at one time are correlated: a standard error of 0.02.
    let share = shares(&trained(), 60);
    assert!((0.84..=0.96).contains(&share), "{share}");
}

#[test]
fn functions_of_a_polynomial_are_simulated_as_the_rates_were_inferred() {
    let study = trained().replace("parameters = [\"k\", \"c\", \"d\"]", "basis = \"polynomial\"\ndegree = 1");
    let study = study.replace("block = 300", "diffusion = \"full\"");
    let share = shares(&study, 30);
    // 30 twins: 0.028.
    assert!((0.82..=0.98).contains(&share), "{share}");
}

#[test]
fn one_worker_and_two_give_the_same_bytes_and_coverage_counts_what_was_held_out() {
    let dir = folder(&trained(), &twin(3, 2_200));
    infer(dir.path(), "out", "1");
    let asked =
        ["out", "--members", "50", "--level", "both>0.5", "--until", "23", "--horizon", "21", "--json"];
    let (code, stdout, stderr) = forecast(dir.path(), &[&asked[..], &["--workers", "1"]].concat());
    assert_eq!(code, 0, "{stderr}");
    let files = ["forecast.json", "fan.csv", "crossing-times.csv", "report.html"];
    let read = || files.map(|name| bytes(&dir.path().join("out/forecast"), name));
    let first = read();
    let (code, _, stderr) = forecast(dir.path(), &[&asked[..], &["--workers", "2"]].concat());
    assert_eq!(code, 0, "{stderr}");
    assert!(first == read(), "one worker and two give the same bytes");
    let found: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(
        (&found["from"], &found["until"], &found["model_noise"]),
        (&20.0.into(), &23.0.into(), &true.into())
    );
    let coverage = &found["outputs"][0]["coverage90"];
    assert!(coverage["train"].is_null() && coverage["held_out"].is_f64(), "{coverage}");
    let level = &found["levels"][0];
    assert!(level["crossed"].as_u64().unwrap() + level["never"].as_u64().unwrap() == 50, "{level}");
    assert!(level["probability_by_horizon"].as_f64() <= level["probability"].as_f64(), "{level}");
    // A coefficient that all members have: without coupling and noise of its own both decay apart.
    let set = ["out", "--set", "c=0", "--members", "5", "--workers", "1", "--json"];
    let (code, other, stderr) = forecast(dir.path(), &set);
    assert_eq!(code, 0, "{stderr}");
    assert!(other.contains("\"c\",") && !stdout.contains("\"c\","), "{other}");
}

#[test]
fn a_running_inference_is_forecast_from_its_state() {
    let dir = folder(STUDY, "");
    let data = recording(3_000, usize::MAX);
    let (code, _, stderr) = followed(dir.path(), &data, &["--state", "state.json"]);
    assert_eq!(code, 0, "{stderr}");
    let asked = [
        "state.json",
        "--study",
        "study.toml",
        "--until",
        "31",
        "--members",
        "40",
        "--workers",
        "1",
        "--json",
    ];
    let (code, stdout, stderr) = forecast(dir.path(), &asked);
    assert_eq!(code, 0, "{stderr}");
    let found: Value = serde_json::from_str(&stdout).unwrap();
    // Members start at the last row of the last whole block.
    assert_eq!((&found["from"], &found["members"]), (&30.0.into(), &40.into()));
    let last: Vec<f64> = data.lines().last().unwrap().split(',').map(|v| v.parse().unwrap()).collect();
    let fan = String::from_utf8(bytes(&dir.path().join("state-forecast"), "fan.csv")).unwrap();
    let start: Vec<&str> = fan.lines().nth(1).unwrap().split(',').collect();
    assert_eq!((start[0], start[2]), ("x", "30.0"));
    assert!((start[7].parse::<f64>().unwrap() - last[1]).abs() < 1e-12, "{start:?} for {last:?}");
    let (code, _, stderr) = forecast(dir.path(), &["state.json", "--until", "31"]);
    assert!(code == 2 && stderr.contains("--study FILE"), "{stderr}");
    fs::write(dir.path().join("study.toml"), STUDY.replace("level = 0.0", "level = 1.0")).unwrap();
    let (code, _, stderr) = forecast(dir.path(), &["state.json", "--study", "study.toml", "--until", "31"]);
    assert!(code == 2 && stderr.contains("state of another study"), "{stderr}");
}

#[test]
fn what_makes_no_forecast_of_an_inference_is_told() {
    let dir = folder(STUDY, &recording(2_000, usize::MAX));
    infer(dir.path(), "out", "1");
    let told = [
        (&[][..], "say how far it goes with --until T"),
        (&["--until", "3"], "--until 3: give a time after the start at 20"),
        (&["--until", "30", "--level", "w>1"], "no output or scalar state named `w`"),
        (&["--until", "30", "--set", "kk=2"], "did you mean `k`?"),
        (&["--until", "30", "--record", "fall"], "the study has: path"),
        (&["--until", "30", "--members", "0"], "give at least one member"),
    ];
    for (extra, says) in told {
        let (code, _, stderr) = forecast(dir.path(), &[&["out", "--workers", "1"][..], extra].concat());
        assert!(code == 2 && stderr.contains(says), "{extra:?}: {stderr}");
    }
    // The result of an earlier version has no covariance.
    let path = dir.path().join("out/infer.json");
    let mut found: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    found.as_object_mut().unwrap().remove("covariance");
    fs::write(&path, found.to_string()).unwrap();
    let (code, _, stderr) = forecast(dir.path(), &["out", "--until", "30"]);
    assert!(code == 2 && stderr.contains("infer again"), "{stderr}");
}
