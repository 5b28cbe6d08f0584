//! Channels derived from what was measured: displacement from velocity data, and the other way round.
#![allow(clippy::unwrap_used)]
mod study_kit;

use starlings_coordinator::study::Study;
use study_kit::{Case, csv, grid};

/// An oscillator whose position is x = cos 2t: k = 4, no damping.
fn study(channel: &str) -> String {
    format!(
        r#"
[study]
name = "spring"
[model]
kind = "equations"
outputs = [ {{ name = "position", unit = "m", value = "x" }}, {{ name = "speed", unit = "m/s", value = "v" }} ]
[[model.states]]
name = "x"
initial = 1.0
rate = "v"
[[model.states]]
name = "v"
rate = "-k*x"
[[parameters]]
name = "k"
prior = {{ transform = "log", median = 3.5, factor = 1.5 }}
[[records]]
name = "swing"
file = "swing.csv"
channels = [ {{ {channel} }} ]
"#
    )
}

const N: usize = 400;
const STEP: f64 = 0.01;

fn case(channel: &str) -> Case {
    let times = grid(N, STEP);
    let x: Vec<f64> = times.iter().map(|t| (2.0 * t).cos()).collect();
    let v: Vec<f64> = times.iter().map(|t| -2.0 * (2.0 * t).sin()).collect();
    Case::new(&study(channel), &[("swing.csv", csv("time,x,v", &[&times, &x, &v]))])
}

const RATE: &str = "column = \"v\", from = \"rate\", start = 1.0, output = \"position\", noise = 0.1";
const INTEGRAL: &str = "column = \"x\", from = \"integral\", output = \"speed\", noise = 0.001";

fn channel(study: &Study) -> (&[f64], f64, &str) {
    let channel = &study.records[0].channels[0];
    (&channel.values, channel.noise, &channel.noise_how)
}

#[test]
fn a_rate_is_integrated_and_its_noise_adds_up() {
    let study = case(RATE).study();
    let (values, noise, how) = channel(&study);
    for (k, value) in values.iter().enumerate() {
        // The trapezoidal rule errs by t h²/12 max|v''| = 4 · 1e-4/12 · 8 at most.
        assert!((value - (2.0 * STEP * k as f64).cos()).abs() < 3e-4, "row {k}: {value}");
    }
    // σ h √(k − 1/2) after k steps, in the mean square over the rows.
    let sum: f64 = (1..N).map(|k| k as f64 - 0.5).sum();
    let wanted = 0.1 * STEP * (sum / N as f64).sqrt();
    assert!((noise / wanted - 1.0).abs() < 1e-9, "{noise} {wanted}");
    assert!(how.contains("at the end"), "{how}");
    assert!(study.warnings.iter().any(|w| w.contains("not independent in time")), "{:?}", study.warnings);
}

#[test]
fn an_integral_is_differentiated_between_its_neighbours() {
    let study = case(INTEGRAL).study();
    let (values, noise, _) = channel(&study);
    // The first and the last row have no neighbour on one side.
    assert_eq!((values.len(), study.records[0].times.len()), (N - 2, N - 2));
    for (value, t) in values.iter().zip(&study.records[0].times) {
        // h²/6 max|x'''| = 1e-4/6 · 8.
        assert!((value + 2.0 * (2.0 * t).sin()).abs() < 1.4e-4, "t = {t}: {value}");
    }
    let wanted = 0.001 * 2.0_f64.sqrt() / (2.0 * STEP);
    assert!((noise / wanted - 1.0).abs() < 1e-9, "{noise} {wanted}");
}

#[test]
fn either_way_determines_the_stiffness() {
    for channel in [RATE, INTEGRAL] {
        // From the second row on for the integral: a swing that starts a hundredth of a second later.
        let done = case(channel).run();
        let k = done.estimate("k").estimate;
        assert!((k - 4.0).abs() < 0.08, "{channel}: {k}");
    }
}

#[test]
fn what_a_column_cannot_hold_is_refused() {
    let refused = |from: &str, to: &str, channel: &str| {
        let folder = tempfile::tempdir().unwrap();
        let times = grid(N, STEP);
        std::fs::write(folder.path().join("swing.csv"), csv("time,x,v", &[&times, &times, &times])).unwrap();
        let file = folder.path().join("study.toml");
        std::fs::write(&file, study(&channel.replace(from, to))).unwrap();
        Study::load(&file).unwrap_err().to_string()
    };
    let told = refused("\"rate\"", "\"rat\"", RATE);
    assert!(
        told.contains("a column cannot hold the `rat` of an output") && told.contains("`rate`"),
        "{told}"
    );
    let told = refused("noise", "start = 0.0, noise", INTEGRAL);
    assert!(told.contains("`start` is the value at which an integral begins"), "{told}");
}
