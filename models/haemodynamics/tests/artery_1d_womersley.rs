//! Friction of unsteady laminar flow: against Womersley's longitudinal impedance, and Poiseuille's where the flow is slow.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod artery_1d_kit;

use std::f64::consts::{PI, TAU};

use artery_1d_kit::{artery, drive, outputs, rate, refused, run, start, theta};
use nalgebra::Complex;
use starlings_haemodynamics::Artery1d;
use starlings_models_core::{Model, Spec};

/// Cells of a tube of 5 cm and radius 1 cm.
const N: usize = 20;
const RHO: f64 = 1.06;

fn layout(more: &[(&str, serde_json::Value)]) -> serde_json::Value {
    let mut segment = serde_json::json!({
        "name": "tube", "from": "heart", "to": "out", "length": 5.0, "radius": 1.0, "thickness": 0.2, "cells": N,
    });
    for (key, value) in more {
        segment[key] = value.clone();
    }
    serde_json::json!({
        "segments": [segment],
        "nodes": [{ "name": "heart", "kind": "inlet" }, { "name": "out", "kind": "resistance" }],
    })
}

fn tube(friction: &str) -> Artery1d {
    artery(layout(&[("friction", friction.into())]))
}

/// J_k(z) by its series.
fn bessel(k: i32, z: Complex<f64>) -> Complex<f64> {
    let (half, mut i) = (z * 0.5, 1.0);
    let mut term = half.powi(k);
    let mut sum = term;
    while term.norm() > 1e-18 * sum.norm() || i < 20.0 {
        term = -term * half * half / (i * (i + f64::from(k)));
        sum += term;
        i += 1.0;
    }
    sum
}

/// Womersley's −dp/dx per flow in a tube of radius 1 with ν = 1, at this α (Womersley 1955).
fn impedance(alpha: f64) -> Complex<f64> {
    let lambda = Complex::from_polar(alpha, 0.75 * PI);
    let profile = -bessel(1, lambda) / (lambda * bessel(0, lambda)) * 2.0 + 1.0;
    Complex::new(0.0, RHO * alpha * alpha / PI) / profile
}

/// −dp/dx per flow in the middle of the tube, which a sine of this α enters.
fn found(model: &Artery1d, alpha: f64, c_w: f64) -> Complex<f64> {
    let own = [("mu", RHO), ("p0", 0.0), ("c_w", c_w), ("R_out", 200.0), ("E1", 2e7)];
    let theta = theta(model, &own);
    let (samples, omega) = (100, alpha * alpha);
    let step = TAU / omega / f64::from(samples);
    // Small: heights of 1e-6 of the radius.
    let flow = |t: f64| 1e-3 * (omega * t).sin();
    let mut x = start(model, &theta);
    // The slowest memory fades with 1/26 s, the tube empties faster.
    let before = samples * (0.8 / (step * f64::from(samples))).ceil().max(1.0) as i32;
    drive(model, &theta, &mut x, 0..before as usize, step, &flow);
    let (mut push, mut passed) = (Complex::from(0.0), Complex::from(0.0));
    for k in before..before + samples {
        // The flow is linear between its samples and its slope one of steps: the places are even around the middle of each.
        let part = |i: i32| {
            let (from, to) = (flow(f64::from(k) * step), flow(f64::from(k + 1) * step));
            ((f64::from(k) + f64::from(i) / 8.0) * step, from + (to - from) * f64::from(i) / 8.0)
        };
        for i in 0..8 {
            let [(t0, from), (t1, to)] = [part(i), part(i + 1)];
            run(model, &theta, &mut x, [t0, t1], [from, to]);
            if i % 2 == 0 {
                let (y, turn) = (outputs(model, &theta, &x, to), Complex::from_polar(1.0, -omega * t1));
                let (pressure, middle) = (&y[N..2 * N], N / 2);
                push += turn * (pressure[middle - 1] - pressure[middle + 1]) / 0.5;
                passed += turn * x[N + middle];
            }
        }
    }
    push / passed
}

#[test]
fn pressure_gradient_and_flow_are_those_of_womersley_from_slow_to_fast() {
    let (model, steady) = (tube("womersley"), tube("steady"));
    for alpha in [2.0, 3.0, 5.0, 8.0, 12.0, 20.0] {
        for c_w in [0.0, 2e3] {
            let wanted = impedance(alpha);
            let off = (found(&model, alpha, c_w) / wanted - 1.0).norm();
            // 0.0015 by the ten terms; the rest is of the grid.
            assert!(off < 3e-3, "α = {alpha}, c_w = {c_w}: off by {off}");
        }
    }
    // Poiseuille's friction alone lacks the inertia of a parabola and the shear of a thin layer.
    for (alpha, least) in [(2.0, 0.1), (5.0, 0.1), (20.0, 0.05)] {
        let off = (found(&steady, alpha, 0.0) / impedance(alpha) - 1.0).norm();
        assert!(off > least, "α = {alpha}: steady friction is off by {off} only");
    }
}

#[test]
fn a_steady_flow_rubs_as_poiseuille_says() {
    for c_w in [0.0, 2e3] {
        let end = |friction: &str| {
            let model = tube(friction);
            let theta = theta(&model, &[("mu", 0.5), ("c_w", c_w)]);
            let mut x = start(&model, &theta);
            run(&model, &theta, &mut x, [0.0, 0.5], [0.0, 40.0]);
            run(&model, &theta, &mut x, [0.5, 8.0], [40.0, 40.0]);
            let still = rate(&model, &theta, &x, 40.0).iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            (outputs(&model, &theta, &x, 40.0)[N..2 * N].to_vec(), still)
        };
        let ((steady, _), (found, still)) = (end("steady"), end("womersley"));
        assert!(still < 1e-3, "not steady: {still}");
        let drop = steady[0] - steady[N - 1];
        for (a, b) in found.iter().zip(&steady) {
            // Of a drop of 600 dyn/cm²: what has not faded in 8 s.
            assert!((a - b).abs() < 1e-6 * drop, "{a} against {b}");
        }
    }
}

#[test]
fn what_the_wall_remembers_is_a_state_like_others_and_runs_in_pieces_are_runs_in_one() {
    let model = artery(serde_json::json!({
        "segments": [
            { "name": "a", "from": "heart", "to": "x", "length": 5.0, "radius": 0.5, "thickness": 0.1, "cells": 6 },
            { "name": "b", "from": "x", "to": "out", "length": 5.0, "radius": 0.4, "thickness": 0.1, "cells": 4,
              "friction": "womersley" },
        ],
        "nodes": [{ "name": "heart", "kind": "inlet" }, { "name": "out", "kind": "rcr" }],
    }));
    let states: Vec<(&str, usize)> = model.spec().states.iter().map(|q| (q.name.as_str(), q.size)).collect();
    // Ten parts in each of the four cells that asked.
    assert_eq!(states, [("A", 10), ("Q", 10), ("pi", 1), ("w", 40)]);
    let memory = Spec::range_of(&model.spec().states, "w").unwrap();
    for c_w in [0.0, 2e3] {
        let theta = theta(&model, &[("c_w", c_w)]);
        let flow = |t: f64| 10.0 * (PI * t / 0.3).sin();
        let (mut x, mut pieces) = (start(&model, &theta), start(&model, &theta));
        assert!(x[memory.clone()].iter().all(|w| *w == 0.0));
        drive(&model, &theta, &mut x, 0..20, 1e-2, &flow);
        for i in 0..20 {
            let mut next = pieces.clone();
            drive(&model, &theta, &mut next, i..i + 1, 1e-2, &flow);
            pieces = next;
        }
        assert_eq!(x, pieces);
        assert!(x[memory.clone()].iter().all(|w| *w != 0.0), "all of them are felt");
        let (dx, before, h) = (rate(&model, &theta, &x, flow(0.2)), x.clone(), 1e-10);
        run(&model, &theta, &mut x, [0.0, h], [flow(0.2); 2]);
        for at in [10..20, memory.clone()].into_iter().flatten() {
            let found = (x[at] - before[at]) / h;
            // Differences lose most digits: of rates up to 1e5 cm/s² and cm³/s².
            assert!((found - dx[at]).abs() < 1e-3 * dx[at].abs() + 10.0, "{at}: {found} against {}", dx[at]);
        }
    }
}

#[test]
fn a_profile_that_the_friction_does_not_have_is_refused() {
    let told = |more: &[(&str, serde_json::Value)]| refused(&layout(more));
    let (path, message) = told(&[("friction", "womersley".into()), ("profile", 9.0.into())]);
    assert!(
        path == "segments[0].profile" && message.contains("leave one of the two out"),
        "{path}: {message}"
    );
    let (path, message) = told(&[("friction", "turbulent".into())]);
    assert!(path == "segments[0].friction" && message.contains("unknown variant"), "{path}: {message}");
}
