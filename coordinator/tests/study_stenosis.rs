//! How narrow a stenosis is, from the pressures on its two sides: recordings of a finer grid, with noise.
#![allow(clippy::unwrap_used)]
mod study_kit;

use std::f64::consts::PI;

use starlings_models::limits::Limits;
use starlings_models::native::Artery1d;
use starlings_models::segment::Segment;
use starlings_models::{Drive, Model, Spec};
use study_kit::{Case, csv, grid, normals, run_once};

const SEVERITY: f64 = 0.8;
const DISTAL: f64 = 9000.0;
/// 1 mmHg.
const NOISE: f64 = 1333.22;
/// Samples of the inflow, 5 ms apart, and those from one observation to the next.
const SAMPLES: usize = 320;
const EVERY: usize = 4;
/// Cells of a vessel of the recordings.
const FINE: usize = 20;

/// Two beats of 0.8 s in cm³/s.
fn inflow(sample: usize) -> f64 {
    let t = (sample % (SAMPLES / 2)) as f64 * 5e-3;
    if t < 0.3 { 3.0 + 15.0 * (PI * t / 0.3).sin() } else { 3.0 }
}

fn model() -> Artery1d {
    let vessel = |name: &str, from: &str, to: &str| {
        serde_json::json!({
            "name": name, "from": from, "to": to, "length": 10.0, "radius": 0.3, "thickness": 0.06, "cells": FINE,
        })
    };
    let layout = serde_json::json!({
        "segments": [vessel("before", "heart", "narrow"), vessel("behind", "narrow", "leg")],
        "nodes": [
            { "name": "heart", "kind": "inlet" },
            { "name": "narrow", "kind": "stenosis", "length": 1.0 },
            { "name": "leg", "kind": "rcr" },
        ],
    });
    Artery1d::new(&serde_json::from_value(layout).unwrap()).unwrap()
}

/// Pressures at both ends at the times of observation.
fn truth() -> [Vec<f64>; 2] {
    let model = model();
    let parameters = &model.spec().parameters;
    let theta: Vec<f64> = parameters
        .iter()
        .map(|q| match q.name.as_str() {
            "severity" => SEVERITY,
            "R_d" => DISTAL,
            _ => q.default.unwrap(),
        })
        .collect();
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(&theta, &mut x);
    let history = Drive::NONE.history;
    let mut pressures = [Vec::new(), Vec::new()];
    for sample in 0..=SAMPLES {
        if sample % EVERY == 0 {
            let mut y = vec![0.0; model.spec().n_output()];
            let u = Drive { value: &[inflow(sample)], slope: &[0.0], history };
            model.output(0.0, &x, &theta, u, &mut y);
            for (pressures, name) in pressures.iter_mut().zip(["inlet_pressure", "outlet_pressure"]) {
                pressures.push(y[Spec::offset(&model.spec().outputs, name).unwrap()]);
            }
        }
        let times = [sample, sample + 1].map(|i| i as f64 * 5e-3);
        let (u0, slope) = ([inflow(sample)], [(inflow(sample + 1) - inflow(sample)) / 5e-3]);
        let limits = Limits::none();
        let segment = Segment {
            t0: times[0],
            t1: times[1],
            u0: &u0,
            slope: &slope,
            history,
            limits: &limits,
            noise: None,
        };
        model.advance(segment, &theta, &mut x).unwrap();
    }
    pressures
}

/// Two vessels of 10 cm and radius 0.3 cm around a stenosis of 1 cm, on half as fine a grid.
const STUDY: &str = r#"
[study]
name = "stenosis"
[model]
kind = "artery-1d"
[model.layout]
segments = [
  { name = "before", from = "heart", to = "narrow", length = 10.0, radius = 0.3, thickness = 0.06, cells = 10 },
  { name = "behind", from = "narrow", to = "leg", length = 10.0, radius = 0.3, thickness = 0.06, cells = 10 },
]
nodes = [
  { name = "heart", kind = "inlet" },
  { name = "narrow", kind = "stenosis", length = 1.0 },
  { name = "leg", kind = "rcr" },
]
[[parameters]]
name = "severity"
prior = { transform = "logit(0, 0.99)", median = 0.5, factor = 3.0 }
[[parameters]]
name = "R_d"
prior = { transform = "log", median = 6000.0, factor = 1.5 }
[[records]]
name = "ends"
file = "ends.csv"
inputs = { flow = "flow.csv:flow" }
channels = [
  { column = "before", output = "inlet_pressure", noise = 1333.22 },
  { column = "behind", output = "outlet_pressure", noise = 1333.22 },
]
[estimator]
passes = 3
"#;

#[test]
fn the_severity_of_a_stenosis_is_found_from_the_pressures_on_its_two_sides() {
    let [before, behind] = truth();
    let n = before.len();
    let errors = normals(2 * n, 5);
    let noisy = |of: &[f64], errors: &[f64]| -> Vec<f64> {
        of.iter().zip(errors).map(|(p, e)| p + NOISE * e).collect()
    };
    let (before, behind) = (noisy(&before, &errors[..n]), noisy(&behind, &errors[n..]));
    let flow: Vec<f64> = (0..=SAMPLES).map(inflow).collect();
    let files = [
        ("ends.csv", csv("time,before,behind", &[&grid(n, 5e-3 * EVERY as f64), &before, &behind])),
        ("flow.csv", csv("time,flow", &[&grid(SAMPLES + 1, 5e-3), &flow])),
    ];
    let done = run_once(STUDY, &files);
    for (name, wanted, most) in [("severity", SEVERITY, 0.01), ("R_d", DISTAL, 200.0)] {
        let found = done.estimate(name);
        // From 0.5 and 6000; of its own uncertainty the error is an ordinary draw.
        assert!((found.estimate - wanted).abs() < most, "{name}: {}", found.estimate);
    }
    let nis = done.summary.fit.nis_per_observation;
    assert!((0.7..1.3).contains(&nis), "the model explains the data: {nis}");
    let closed =
        Case::new(&STUDY.replace("[model.layout]", "constants = { K_u = 0.0 }\n[model.layout]"), &files)
            .refusal()
            .unwrap();
    assert!(closed.contains("K_u") && closed.contains("> 0"), "{closed}");
}
