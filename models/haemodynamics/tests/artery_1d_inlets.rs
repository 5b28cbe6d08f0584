//! Arterial networks that several flows enter: what they conserve, and how their waves join.
#![allow(clippy::unwrap_used)]

mod artery_1d_kit;

use std::f64::consts::PI;

use artery_1d_kit::{QUIET, artery, output, outputs_inlets, run_inlets, speed, start, theta};
use starlings_haemodynamics::Artery1d;
use starlings_models_core::Model;

/// Cells of each vessel of 25 cm.
const N: usize = 100;

fn vessel(name: &str, from: &str, to: &str, radius: f64, thickness: f64) -> serde_json::Value {
    serde_json::json!({
        "name": name, "from": from, "to": to, "length": 25.0, "radius": radius, "thickness": thickness, "cells": N,
    })
}

/// Two vessels of radius 1 cm that join in a trunk.
fn confluence() -> Artery1d {
    artery(serde_json::json!({
        "segments": [
            vessel("left", "left_heart", "meeting", 1.0, 0.15),
            vessel("right", "right_heart", "meeting", 1.0, 0.15),
            vessel("trunk", "meeting", "out", 1.2, 0.15),
        ],
        "nodes": [
            { "name": "left_heart", "kind": "inlet" },
            { "name": "right_heart", "kind": "inlet" },
            { "name": "out", "kind": "rcr" },
        ],
    }))
}

/// One vessel of twice the area and the same speed of waves in place of the two: K R is the same, E h/R0² a √2-th.
fn single() -> Artery1d {
    let root = 2.0_f64.sqrt();
    artery(serde_json::json!({
        "segments": [
            vessel("both", "heart", "meeting", root, 0.15 * root),
            vessel("trunk", "meeting", "out", 1.2, 0.15),
        ],
        "nodes": [{ "name": "heart", "kind": "inlet" }, { "name": "out", "kind": "rcr" }],
    }))
}

/// A pulse of 10 ms in cm³/s.
fn pulse(t: f64, height: f64) -> f64 {
    if t < 0.01 { height * (PI * t / 0.01).sin().powi(2) } else { 0.0 }
}

/// Runs 60 ms in which a pulse enters every inlet.
fn send(model: &Artery1d, theta: &[f64], height: f64) -> Vec<f64> {
    let (mut x, n) = (start(model, theta), model.spec().inputs.len());
    for i in 0..120 {
        let times = [i, i + 1].map(|i| f64::from(i) * 5e-4);
        let flows = times.map(|t| vec![pulse(t, height); n]);
        run_inlets(model, theta, &mut x, times, [&flows[0], &flows[1]]);
    }
    x
}

#[test]
fn waves_of_two_inlets_join_as_those_of_one_with_twice_the_area() {
    let (two, one) = (confluence(), single());
    let (theta_two, theta_one) = (theta(&two, &QUIET), theta(&one, &QUIET));
    for height in [1e-3, 200.0] {
        let (x, y) = (send(&two, &theta_two, height), send(&one, &theta_one, 2.0 * height));
        let [trunk, same] = [&x[5 * N..6 * N], &y[3 * N..4 * N]];
        let size = same.iter().fold(0.0_f64, |size, q| size.max(q.abs()));
        assert!(size > 0.5 * height, "the pulse has come: {size}");
        for (a, b) in trunk.iter().zip(same) {
            // The equations are the same, A and Q doubled; the measure of what is smooth has a radius in it, and moves what is steepest by 0.003.
            assert!((a - b).abs() < 5e-3 * size, "{a} against {b} of {size}");
        }
    }
}

#[test]
fn small_waves_of_two_inlets_go_on_as_linear_theory_says() {
    let model = confluence();
    let theta = theta(&model, &QUIET);
    let x = send(&model, &theta, 1e-3);
    // c² = K R0/(2ρ) with K = E h/((1 − ν²) R0²), admittance A/(ρc).
    let c = [speed(), speed() / 1.2_f64.sqrt()];
    let admittance = [PI / (1.06 * c[0]), PI * 1.44 / (1.06 * c[1])];
    let sent = 2.0 * admittance[0];
    let transmission = 2.0 * sent / (sent + admittance[1]);
    // Each pulse holds 1e-3 · 5 ms, and its pressure, Q/Y, is as long as its speed makes it.
    let wanted = transmission * (1e-3 * 5e-3 / admittance[0]) * c[1];
    let stiffness = 1e6 / 1.44;
    let found: f64 = x[2 * N..3 * N].iter().map(|a| stiffness * ((a / PI).sqrt() - 1.2) * 0.25).sum();
    // A pulse that is sampled every half millisecond, heights of 1e-6 of the radius.
    assert!((found / wanted - 1.0).abs() < 1e-3, "{found} against {wanted}");
}

#[test]
fn every_drop_that_enters_at_either_inlet_is_accounted_for() {
    let model = confluence();
    let theta = theta(&model, &[]);
    let mut x = start(&model, &theta);
    let before = model.volume(&x);
    let beat = |t: f64, late: f64| {
        let t = (t - late).rem_euclid(0.8);
        if t < 0.3 { 100.0 * (PI * t / 0.3).sin() } else { 0.0 }
    };
    let [mut inflow, mut outflow] = [0.0; 2];
    for i in 0..240 {
        let times = [i, i + 1].map(|i| f64::from(i) * 0.01);
        let flows = times.map(|t| [beat(t, 0.0), beat(t, 0.2)]);
        let [entered, left] = run_inlets(&model, &theta, &mut x, times, [&flows[0], &flows[1]]);
        inflow += entered;
        outflow += left;
    }
    let stored = model.volume(&x) - before;
    // Three beats of two half sines, sampled every 10 ms, less what the trapezoid loses of them.
    assert!((inflow / (6.0 * 100.0 * 0.6 / PI) - 1.0).abs() < 1e-3, "{inflow}");
    assert!(((inflow - outflow - stored) / inflow).abs() < 1e-12, "{inflow} - {outflow} against {stored}");
}

#[test]
fn each_inlet_has_its_own_flow_and_pressure_by_name() {
    let model = confluence();
    let names =
        |list: &[starlings_models_core::Quantity]| list.iter().map(|q| q.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&model.spec().inputs), ["flow_left_heart", "flow_right_heart"]);
    assert_eq!(
        names(&model.spec().outputs)[3..7],
        ["inlet_pressure_left_heart", "inlet_pressure_right_heart", "outlet_pressure", "outflow"]
    );
    assert_eq!(names(&single().spec().inputs), ["flow"]);
    let theta = theta(&model, &[]);
    let mut x = start(&model, &theta);
    // The pressure rises first where the flow enters, and by ρc/A of it.
    run_inlets(&model, &theta, &mut x, [0.0, 0.01], [&[0.0, 0.0], &[0.0, 20.0]]);
    let y = outputs_inlets(&model, &theta, &x, &[0.0, 20.0]);
    let [left, right] =
        ["left", "right"].map(|side| output(&model, &y, &format!("inlet_pressure_{side}_heart")));
    assert!(right - left > 2e3 && (left / (80.0 * 1333.22) - 1.0).abs() < 1e-6, "{left} and {right}");
}

#[test]
fn a_flow_that_is_no_number_is_named_by_its_inlet() {
    let model = confluence();
    let theta = theta(&model, &[]);
    let mut x = start(&model, &theta);
    let segment = starlings_models_core::segment::Segment {
        t0: 0.0,
        t1: 0.1,
        u0: &[1.0, f64::NAN],
        slope: &[0.0, 0.0],
        history: starlings_models_core::Drive::NONE.history,
        limits: &starlings_models_core::limits::Limits::none(),
        noise: None,
    };
    let told = model.advance(segment, &theta, &mut x).unwrap_err().to_string();
    assert!(told.contains("input `flow_right_heart`"), "{told}");
}
