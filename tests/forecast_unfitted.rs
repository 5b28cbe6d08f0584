//! `starlings forecast` of an output that was never fitted: its band holds what its own values show of a sensor that is wrong.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod swing_kit;

use std::fmt::Write;
use std::path::Path;

use common::{output, run, starlings};
use serde_json::Value;
use swing_kit::{NOISE, STUDY, errors, motion};

/// The velocity in the forecast of a twin, which was measured with this gain and noise as stated and never fitted, and the warnings.
fn velocity(folder: &Path, seed: u64, gain: f64) -> (Value, Value) {
    let channel = "channels = [ { column = \"position\", output = \"position\", noise = 0.2 }";
    let held_out = ", { column = \"velocity\", output = \"velocity\", noise = 0.2, use = \"held-out\" }";
    let study = STUDY.replace(channel, &format!("{channel}{held_out}")).replace("train = [0.0, 2.0]", "");
    std::fs::write(folder.join("free.toml"), study).unwrap();
    let mut csv = "time,position,velocity\n".to_owned();
    for (i, pair) in errors(seed, 0.0, 400).chunks(2).enumerate() {
        let t = 0.025 * i as f64;
        let [x, v] = [0, 1].map(|row| motion(t)[(row, 0)]);
        writeln!(csv, "{t},{},{}", x + NOISE * pair[0], gain * v + NOISE * pair[1]).unwrap();
    }
    std::fs::write(folder.join("swing.csv"), csv).unwrap();
    let out = folder.join(format!("run-{seed}-{gain}"));
    run(&folder.join("free.toml"), &out, 1);
    let asked = ["--members", "400", "--workers", "1", "--json"];
    let (code, stdout, stderr) = output(starlings().arg("forecast").arg(&out).args(asked));
    assert_eq!(code, 0, "{stderr}");
    let found: Value = serde_json::from_str(&stdout).unwrap();
    let all = found["outputs"].as_array().unwrap();
    let velocity = all.iter().find(|output| output["output"] == "velocity").unwrap();
    (velocity.clone(), found["warnings"].clone())
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn a_sensor_that_is_right_has_no_wider_a_band() {
    let folder = tempfile::tempdir().unwrap();
    let n = 8;
    let (mut share, mut sd) = (0.0, 0.0);
    for seed in 0..n {
        let (right, _) = velocity(folder.path(), seed, 1.0);
        share += number(&right["coverage90"]["held_out"]) / n as f64;
        sd += number(&right["errors"]["sd"]) / n as f64;
    }
    // 8 twins of 200 values: a standard error of 0.01. What the fit leaves of the start adds to some of them what it takes from none.
    assert!((0.85..=0.95).contains(&share), "{share}");
    assert!(sd < 1.2 * NOISE, "{sd}");
}

#[test]
fn a_sensor_that_is_wrong_has_a_band_that_holds_it_and_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    // Six tenths of a swing of 2.9 at first are missing, four noise sd on average.
    let (wrong, warnings) = velocity(folder.path(), 1, 1.6);
    let [own, by_fit] = ["held_out", "held_out_by_fit"].map(|key| number(&wrong["coverage90"][key]));
    assert!(by_fit < 0.4 && (0.8..=0.97).contains(&own), "{wrong}");
    assert_eq!(wrong["errors"]["from"], "own-values");
    let told = |warning: &Value| warning.as_str().unwrap().contains("how far off `velocity` is");
    assert!(warnings.as_array().unwrap().iter().any(told), "{warnings}");
}
