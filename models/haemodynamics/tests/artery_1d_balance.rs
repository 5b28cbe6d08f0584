//! What arterial networks conserve, and where they stay.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod artery_1d_kit;

use std::f64::consts::PI;

use artery_1d_kit::{artery, bifurcation, drive, output, outputs, rate, refused, run, start, theta, tube};
use starlings_haemodynamics::Artery1d;
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::Segment;
use starlings_models_core::{Model, ModelFailure};

/// A half sine of 0.3 s in every beat of 0.8 s.
fn beat(t: f64) -> f64 {
    let t = t.rem_euclid(0.8);
    if t < 0.3 { 300.0 * (PI * t / 0.3).sin() } else { 0.0 }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().map(|v| v.abs()).fold(0.0, f64::max)
}

#[test]
fn a_vessel_of_varying_radius_and_stiffness_at_rest_stays_at_rest() {
    let model = tube(20, 5, 0.5);
    for c_w in [0.0, 2e3] {
        let own = [("E2", 1e7), ("E4", 3e6), ("c_w", c_w), ("p0", 1e5), ("p_venous", 1e5), ("p_ext", 3e3)];
        let theta = theta(&model, &own);
        let mut x = start(&model, &theta);
        let first = x.clone();
        run(&model, &theta, &mut x, [0.0, 5.0], [0.0, 0.0]);
        let moved: Vec<f64> = x[..20].iter().zip(&first).map(|(a, b)| a / b - 1.0).collect();
        // Rounding of areas, and against the 1000 cm³/s that a wave of the height of the vessel would carry.
        assert!(largest(&moved) < 1e-14, "{moved:?}");
        assert!(largest(&x[20..40]) < 1e-10, "{:?}", &x[20..40]);
        assert!((x[40] - 1e5).abs() < 1e-8, "{}", x[40]);
    }
}

#[test]
fn a_loop_of_vessels_at_rest_stays_at_rest_and_shares_a_flow() {
    let vessel = |name: &str, from: &str, to: &str, radius: f64| {
        serde_json::json!({
            "name": name, "from": from, "to": to, "length": 5.0, "radius": radius, "thickness": 0.1, "cells": 5,
        })
    };
    let model = artery(serde_json::json!({
        "segments": [
            vessel("trunk", "heart", "a", 1.0),
            vessel("upper", "a", "b", 0.7),
            // Against the direction of the flow.
            vessel("lower", "b", "a", 0.7),
            vessel("end", "b", "out", 0.9),
        ],
        "nodes": [{ "name": "heart", "kind": "inlet" }, { "name": "out", "kind": "resistance" }],
    }));
    let theta = theta(&model, &[("p_venous", 8e4), ("p0", 8e4)]);
    let mut x = start(&model, &theta);
    run(&model, &theta, &mut x, [0.0, 0.5], [0.0, 0.0]);
    assert!(largest(&x[20..]) < 1e-10, "{:?}", &x[20..]);
    run(&model, &theta, &mut x, [0.5, 3.0], [0.0, 60.0]);
    for i in 0..5 {
        // Twins, but for the direction in which their cells are counted.
        assert!((x[25 + i] + x[34 - i]).abs() < 1e-8, "{:?}", &x[25..35]);
    }
    assert!(x[27] > 10.0 && x[27] < 30.0, "{}: half of up to 60 cm³/s", x[27]);
}

#[test]
fn every_drop_of_a_hundred_beats_is_accounted_for() {
    for (model, own) in [(tube(20, 5, 0.8), &[("E2", 1e7)][..]), (bifurcation(10), &[("E_left", 1e7)])] {
        let theta = theta(&model, own);
        let mut x = start(&model, &theta);
        let before = model.volume(&x);
        let [mut inflow, mut outflow] = [0.0; 2];
        for _ in 0..100 {
            let volumes = drive(&model, &theta, &mut x, 0..80, 0.01, &beat);
            inflow += volumes[0];
            outflow += volumes[1];
        }
        let stored = model.volume(&x) - before;
        // Relative to the 5700 cm³ that passed.
        let missing = (inflow - outflow - stored) / inflow;
        assert!(missing.abs() < 1e-12, "{missing:e} of {inflow}");
        assert!(stored.abs() > 0.1, "nothing was stored: {stored}");
    }
}

#[test]
fn the_rate_of_the_stored_volume_is_what_enters_less_what_leaves() {
    let model = bifurcation(10);
    let theta = theta(&model, &[]);
    let mut x = start(&model, &theta);
    drive(&model, &theta, &mut x, 0..12, 0.01, &beat);
    let flow = beat(0.12);
    let stored = model.volume(&rate(&model, &theta, &x, flow));
    let y = outputs(&model, &theta, &x, flow);
    let out = output(&model, &y, "outflow_left_leg") + output(&model, &y, "outflow_right_leg");
    // Flows of 300 cm³/s through a junction whose flows sum to zero.
    assert!((flow - out - stored).abs() < 1e-10, "{flow} - {out} against {stored}");
}

#[test]
fn a_flow_that_no_vessel_carries_is_an_error_that_says_so() {
    let model = tube(20, 5, 0.8);
    let at = "node `inlet` at t = 0";
    for c_w in [0.0, 2e3] {
        let theta = theta(&model, &[("c_w", c_w)]);
        // Out of the vessel, and more than it carries below the speed of its waves: at 2e4 cm³/s u/c would be 1.2.
        for flow in [-1e5, 2e4, 1e5] {
            let mut x = start(&model, &theta);
            let error = advance(&model, &theta, &mut x, flow).unwrap_err();
            let ModelFailure::Solver(message) = &error else { panic!("{flow}: {error}") };
            assert!(message.contains(" of its waves") && message.contains(at), "{flow}: {message}");
        }
    }
}

/// Advances by a tenth of a second at a constant flow.
fn advance(model: &Artery1d, theta: &[f64], x: &mut [f64], flow: f64) -> Result<(), ModelFailure> {
    let history = starlings_models_core::Drive::NONE.history;
    model.advance(
        Segment {
            t0: 0.0,
            t1: 0.1,
            u0: &[flow],
            slope: &[0.0],
            history,
            limits: &Limits::none(),
            noise: None,
        },
        theta,
        x,
    )
}

#[test]
fn a_flow_as_fast_as_its_waves_inside_a_vessel_is_an_error_that_names_the_cell() {
    let model = tube(20, 5, 0.8);
    for (c_w, alpha) in [(0.0, 1.0), (2e3, 1.3)] {
        let theta = theta(&model, &[("c_w", c_w), ("alpha", alpha)]);
        let mut x = start(&model, &theta);
        x[20 + 7] = 1e4;
        let error = advance(&model, &theta, &mut x, 0.0).unwrap_err();
        assert!(error.to_string().contains("speed of its waves in cell 7 at t = 0"), "{error}");
        assert!(outputs(&model, &theta, &x, 0.0).iter().all(|y| y.is_nan()));
    }
}

#[test]
fn a_state_that_is_not_finite_is_named_whatever_stands_behind_it() {
    let model = tube(20, 5, 0.8);
    for c_w in [0.0, 2e3] {
        let theta = theta(&model, &[("c_w", c_w)]);
        for (i, name) in [(3, "A[3]"), (23, "Q[3]"), (40, "pi")] {
            let mut x = start(&model, &theta);
            x[i] = f64::NAN;
            let what = format!("state `{name}`");
            let error = advance(&model, &theta, &mut x, 0.0).unwrap_err();
            assert_eq!(error, ModelFailure::NotFinite { what, time: 0.0 });
        }
    }
}

#[test]
fn a_vessel_that_has_no_waves_is_an_error_and_not_a_step() {
    let model = tube(20, 5, 0.8);
    let mut theta = theta(&model, &[]);
    let mut x = start(&model, &theta);
    // Only the first region: the cells behind it have waves.
    theta[0] = f64::NAN;
    let error = advance(&model, &theta, &mut x, 0.0).unwrap_err();
    let what = "the speed of waves".to_owned();
    assert_eq!(error, ModelFailure::NotFinite { what, time: 0.0 });
}

#[test]
fn a_layout_that_makes_no_network_is_refused_with_its_place_and_a_remedy() {
    let good = serde_json::json!({
        "segments": [
            { "name": "a", "from": "heart", "to": "x", "length": 5.0, "radius": 1.0, "thickness": 0.1, "cells": 6 },
            { "name": "b", "from": "x", "to": "out", "length": 5.0, "radius": 1.0, "thickness": 0.1, "cells": 6 },
        ],
        "nodes": [{ "name": "heart", "kind": "inlet" }, { "name": "out", "kind": "rcr" }],
    });
    let cases = [
        ("/segments/1/to", serde_json::json!("away"), "nodes[1].name", "no segment"),
        ("/segments/1/to", serde_json::json!("x"), "segments[1].to", "ends where it starts"),
        ("/segments/1/from", serde_json::json!("y"), "segments[0]", "nothing follows `x`"),
        ("/segments/1/name", serde_json::json!("a"), "segments[1].name", "two segments"),
        ("/segments/0/name", serde_json::json!("a b"), "segments[0].name", "letters, digits"),
        ("/segments/0/radius", serde_json::json!(-1.0), "segments[0].radius", "above zero"),
        ("/segments/0/thickness_to", serde_json::json!(0.0), "segments[0].thickness_to", "above zero"),
        ("/segments/0/profile", serde_json::json!(1.0), "segments[0].profile", "2 for a parabola"),
        ("/segments/0/cells", serde_json::json!(1), "segments[0].cells", "at least two"),
        ("/segments/0/regions", serde_json::json!(4), "segments[0].cells", "whole number of cells"),
        ("/segments/0/cells", serde_json::json!(10_000), "segments[1].cells", "10006 cells up to here"),
        ("/segments/0/cells", serde_json::json!(10_000_000_000_u64), "segments[0].cells", "at most 10000"),
        ("/segments/1/regions", serde_json::json!(1000), "segments[1].regions", "1001 regions up to here"),
        ("/segments/0/colour", serde_json::json!("red"), "segments[0].colour", "unknown field"),
        ("/nodes/0/kind", serde_json::json!("rcr"), "nodes", "no inlet: list a node of kind \"inlet\""),
        ("/nodes/1/kind", serde_json::json!("junction"), "nodes", "no outlet"),
        ("/nodes/1/kind", serde_json::json!("pump"), "nodes[1].kind", "unknown variant"),
        ("/nodes/1/name", serde_json::json!("heart"), "nodes[1].name", "two nodes"),
        ("/nodes/1/name", serde_json::json!("x"), "nodes[1].name", "2 segments meet"),
    ];
    for (place, value, path, message) in cases {
        let mut layout = good.clone();
        let (parent, key) = place.rsplit_once('/').unwrap();
        layout.pointer_mut(parent).unwrap()[key] = value;
        let (found, text) = refused(&layout);
        assert_eq!(found, path, "{place}: {text}");
        assert!(text.contains(message), "{place}: {text}");
    }
    let mut twins = good.clone();
    twins["segments"][0]["regions"] = serde_json::json!(2);
    twins["segments"][1]["name"] = serde_json::json!("a_2");
    let (path, text) = refused(&twins);
    assert_eq!(path, "segments[1].name");
    assert!(text.contains("stiffness of `a_2` is `E_a_2`, and so is another: rename"), "{text}");
    let mut island = good.clone();
    island["segments"].as_array_mut().unwrap().extend(["c", "d"].map(|name| {
        serde_json::json!({ "name": name, "from": "p", "to": "q", "length": 5.0, "radius": 1.0, "thickness": 0.1 })
    }));
    assert_eq!(refused(&island).0, "segments[2]");
}

#[test]
fn names_carry_the_vessel_and_the_node_only_where_there_are_several() {
    let names =
        |list: &[starlings_models_core::Quantity]| list.iter().map(|q| q.name.clone()).collect::<Vec<_>>();
    let one = tube(20, 5, 1.0);
    assert_eq!(names(&one.spec().states), ["A", "Q", "pi"]);
    assert_eq!(names(&one.spec().parameters)[..5], ["E1", "E2", "E3", "E4", "E5"]);
    assert_eq!(names(&one.spec().parameters)[15..], ["R_p", "R_d", "C"]);
    let fork = bifurcation(10);
    assert_eq!(names(&fork.spec().states), ["A", "Q", "pi_left_leg"]);
    assert_eq!(names(&fork.spec().parameters)[..3], ["E_aorta", "E_left", "E_right"]);
    assert_eq!(
        names(&fork.spec().parameters)[13..],
        ["R_p_left_leg", "R_d_left_leg", "C_left_leg", "R_out_right_leg"]
    );
    assert_eq!(names(&fork.spec().outputs)[4..6], ["outlet_pressure_left_leg", "outflow_left_leg"]);
}
