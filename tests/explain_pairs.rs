//! `starlings explain` where two effects are missing and each alone leaves more than noise.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::fmt::Write as _;

use common::{output, starlings};
use infer_kit::noise;
use serde_json::Value;

/// A vehicle that coasts down against the air, and against rolling resistance and a viscous friction that its model lacks.
fn coast_down(dir: &std::path::Path) {
    let rolls = |from: f64, until: usize, noise: &mut dyn FnMut() -> f64| {
        let (mut v, mut text, h) = (from, "time,speed\n".to_owned(), 0.01);
        for k in 0..=until * 100 {
            if k % 50 == 0 {
                writeln!(text, "{:?},{:?}", k as f64 * h, v + 0.06 * noise()).unwrap();
            }
            let slows = |v: f64| -4e-4 * v * v - 0.1 - 0.006 * v;
            let half = v + 0.5 * h * slows(v);
            v += h * slows(half);
        }
        text
    };
    let mut noise = noise(8);
    std::fs::write(dir.join("up.csv"), rolls(35.0, 90, &mut noise)).unwrap();
    std::fs::write(dir.join("down.csv"), rolls(22.0, 60, &mut noise)).unwrap();
    let record = |name: &str, until: f64| {
        format!(
            "[[records]]\nname = \"{name}\"\nfile = \"{name}.csv\"\n\
             channels = [{{ column = \"speed\", output = \"speed\", noise = 0.06 }}]\ntrain = [0, {until}]\n"
        )
    };
    let study = format!(
        r#"
[study]
name = "coast-down"
time_unit = "s"
[model]
kind = "equations"
outputs = [{{ name = "speed", unit = "m/s", role = "velocity", value = "v" }}]
[[model.states]]
name = "v"
unit = "m/s"
role = "velocity"
initial = 35.0
rate = "-c*v^2"
[[parameters]]
name = "c"
unit = "1/m"
prior = {{ transform = "log", median = 0.0005, factor = 1.5 }}
[[parameters]]
name = "initial:v"
unit = "m/s"
prior = {{ transform = "linear", median_from = "speed", sd = 0.5 }}
{}{}"#,
        record("up", 59.5),
        record("down", 39.5)
    );
    std::fs::write(dir.join("study.toml"), study).unwrap();
}

#[test]
fn two_effects_that_are_asked_for_by_name_are_tried_together_however_little_the_second_adds() {
    let dir = tempfile::tempdir().unwrap();
    coast_down(dir.path());
    let only = ["--only", "bias-force", "--only", "viscous-friction"];
    let arguments = ["explain", "study.toml", "--out", "out", "--workers", "2", "--json"];
    let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(arguments).args(only));
    assert_eq!(code, 0, "{stderr}");
    let found: Value = serde_json::from_str(&stdout).unwrap();
    let effects = found["effects"].as_array().unwrap();
    let names: Vec<&str> = effects.iter().map(|effect| effect["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["bias-force", "viscous-friction"], "{}", found["headline"]);
    // Either leaves held-out data that fail, and a hundredth of what the first takes away settles them.
    let left = found["held_out"].as_array().unwrap().iter().map(|of| of["after"].as_f64().unwrap());
    assert!(left.into_iter().all(|after| after < 1.5), "{}", found["held_out"]);
}
