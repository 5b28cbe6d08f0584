//! `starlings explain` where two effects are missing and each alone leaves more than noise.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::f64::consts::TAU;
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

/// A ship that rolls in waves under a quadratic drag and a list, both of which its model lacks.
fn ship(dir: &std::path::Path) {
    let (mut noise, h) = (noise(3), 0.01);
    let waves = |t: f64| 0.02 * (TAU * t / 9.0).sin() + 0.015 * (TAU * t / 6.1).sin();
    let slope = |t: f64, [roll, rate]: [f64; 2]| {
        [rate, -0.48 * roll - 0.02 * rate + 1.1 * waves(t) - 0.3 * rate * rate.abs() + 0.01]
    };
    let (mut x, mut text) = ([0.4, 0.0], "time,roll,waves\n".to_owned());
    for k in 0..=12_000 {
        let t = f64::from(k) * h;
        if k % 30 == 0 {
            writeln!(text, "{t:.4},{:?},{:?}", x[0] + 0.004 * noise(), waves(t)).unwrap();
        }
        let first = slope(t, x);
        let middle = slope(t + 0.5 * h, [x[0] + 0.5 * h * first[0], x[1] + 0.5 * h * first[1]]);
        x = [x[0] + h * middle[0], x[1] + h * middle[1]];
    }
    std::fs::write(dir.join("data.csv"), text).unwrap();
    let parameter = |name: &str, unit: &str, median: f64, factor: f64| {
        format!(
            "[[parameters]]\nname = \"{name}\"\nunit = \"{unit}\"\n\
             prior = {{ transform = \"log\", median = {median}, factor = {factor} }}\n"
        )
    };
    let study = format!(
        r#"
[study]
name = "ship"
time_unit = "s"
[model]
kind = "equations"
outputs = [{{ name = "roll", unit = "rad", role = "displacement", value = "phi" }}]
inputs = [{{ name = "waves", unit = "1", role = "other" }}]
[[model.states]]
name = "phi"
unit = "rad"
role = "displacement"
initial = 0.4
rate = "p"
[[model.states]]
name = "p"
unit = "rad/s"
role = "velocity"
initial = 0.0
rate = "-w2*phi - d*p + g*waves"
{}{}{}[[records]]
name = "one"
file = "data.csv"
inputs = {{ waves = "waves" }}
channels = [{{ column = "roll", output = "roll", noise = "auto" }}]
train = [0, 80.1]
"#,
        parameter("w2", "1/s^2", 0.5, 1.2),
        parameter("d", "1/s", 0.03, 1.5),
        parameter("g", "1/s^2", 1.0, 1.3)
    );
    std::fs::write(dir.join("study.toml"), study).unwrap();
}

/// Names of what is told first, with what is told of it, where these arguments are given besides.
fn explained(dir: &std::path::Path, further: &[&str]) -> (Vec<String>, Value) {
    let arguments = ["explain", "study.toml", "--out", "out", "--workers", "2", "--json"];
    let (code, stdout, stderr) = output(starlings().current_dir(dir).args(arguments).args(further));
    assert_eq!(code, 0, "{stderr}");
    let found: Value = serde_json::from_str(&stdout).unwrap();
    let effects = found["effects"].as_array().unwrap();
    (effects.iter().map(|effect| effect["name"].as_str().unwrap().to_owned()).collect(), found)
}

/// A second effect is looked for beside the best one, which an offset of the sensor is here.
#[test]
fn two_effects_that_leave_more_than_noise_give_way_to_two_that_leave_none() {
    let dir = tempfile::tempdir().unwrap();
    ship(dir.path());
    let (names, found) = explained(dir.path(), &[]);
    assert_eq!(names, ["bias-force", "quadratic-drag"], "{}", found["headline"]);
}

/// To first order the second effect adds next to nothing, and the terms nobody listed would take the place of both.
#[test]
fn a_second_effect_that_settles_held_out_data_counts_however_little_it_adds_asked_for_by_name_or_not() {
    let dir = tempfile::tempdir().unwrap();
    coast_down(dir.path());
    let only = ["--only", "bias-force", "--only", "viscous-friction"];
    for arguments in [&only[..], &[]] {
        let (names, found) = explained(dir.path(), arguments);
        // Of a vehicle that never turns round a dry friction is a constant force.
        let [first, second] = names.as_slice() else { panic!("{arguments:?}: {}", found["headline"]) };
        assert!(["bias-force", "coulomb-friction"].contains(&first.as_str()), "{}", found["headline"]);
        assert_eq!(second, "viscous-friction", "{}", found["headline"]);
        // Either alone leaves held-out data that fail.
        let left = found["held_out"].as_array().unwrap().iter().map(|of| of["after"].as_f64().unwrap());
        assert!(left.into_iter().all(|after| after < 1.5), "{}", found["held_out"]);
        std::fs::remove_dir_all(dir.path().join("out")).unwrap();
    }
}
