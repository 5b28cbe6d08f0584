//! A narrowing between two vessels: its loss against the closed form, an equation of its flow alone, and a plain junction.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod artery_1d_kit;

use std::f64::consts::PI;

use artery_1d_kit::{
    QUIET, RHO, artery, drive, output, outputs, rate, refused, run, start, theta, young_tsai,
};
use starlings_haemodynamics::Artery1d;
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::Segment;
use starlings_models_core::{Model, Spec};

const RADIUS: f64 = 0.3;
const AREA: f64 = PI * RADIUS * RADIUS;

/// Two vessels of `length` that join in a node of this kind.
fn layout(length: f64, cells: usize, node: &serde_json::Value) -> serde_json::Value {
    let vessel = |name: &str, from: &str, to: &str| {
        serde_json::json!({
            "name": name, "from": from, "to": to, "length": length, "radius": RADIUS, "thickness": 0.06,
            "cells": cells,
        })
    };
    serde_json::json!({
        "segments": [vessel("before", "heart", "narrow"), vessel("behind", "narrow", "leg")],
        "nodes": [{ "name": "heart", "kind": "inlet" }, node, { "name": "leg", "kind": "rcr" }],
    })
}

fn narrowed(length: f64, cells: usize, of: f64) -> Artery1d {
    artery(layout(length, cells, &serde_json::json!({ "name": "narrow", "kind": "stenosis", "length": of })))
}

/// Resistance and square of Young and Tsai's loss of a narrowing of this length.
fn loss(severity: f64, length: f64, mu: f64) -> [f64; 2] {
    young_tsai(RADIUS, severity, length, mu)
}

/// Place of the flow through the narrowing in the state.
fn flow_at(model: &Artery1d) -> usize {
    Spec::offset(&model.spec().states, "q").unwrap()
}

#[test]
fn a_steady_flow_loses_what_young_and_tsai_say() {
    let model = narrowed(10.0, 10, 1.5);
    for (severity, c_w, flow) in [(0.0, 0.0, 5.0), (0.5, 2e3, 5.0), (0.8, 0.0, -5.0), (0.95, 2e3, 2.0)] {
        let own =
            [("severity", severity), ("c_w", c_w), ("p0", 1e5), ("p_venous", 1e5), ("C", 1e-6), ("mu", 0.04)];
        let theta = theta(&model, &own);
        let mut x = start(&model, &theta);
        run(&model, &theta, &mut x, [0.0, 0.5], [0.0, flow]);
        run(&model, &theta, &mut x, [0.5, 6.0], [flow, flow]);
        let y = outputs(&model, &theta, &x, flow);
        let [viscous, turbulent] = loss(severity, 1.5, 0.04);
        let wanted = (viscous + turbulent * flow.abs()) * flow;
        let found = output(&model, &y, "pressure_drop");
        // Steady to roundings of pressures of 1e5.
        assert!((found - wanted).abs() < 1e-9 * wanted.abs() + 1e-6, "{severity}: {found} against {wanted}");
        assert!((x[flow_at(&model)] - flow).abs() < 1e-9, "{}", x[flow_at(&model)]);
    }
}

#[test]
fn steps_are_short_enough_for_a_stenosis_that_is_shorter_than_a_cell() {
    // A tenth of a cell's length: in the steps of its waves the flow through it would swing without end.
    let flow = |t: f64| 5.0 * (PI * t / 0.3).sin();
    let through = |cells: usize| {
        let model = narrowed(10.0, cells, 0.05);
        let theta = theta(&model, &[("severity", 0.5), ("c_w", 0.0)]);
        let mut x = start(&model, &theta);
        drive(&model, &theta, &mut x, 0..20, 1e-2, &flow);
        x[flow_at(&model)]
    };
    let (coarse, fine) = (through(10), through(40));
    assert!((coarse - fine).abs() < 0.05 * 5.0, "{coarse} and {fine}");
}

/// Height of a pulse of 10 ms, a ten-thousandth of what would be felt in the vessels.
const HEIGHT: f64 = 0.03;

fn pulse(t: f64) -> f64 {
    if (0.0..0.01).contains(&t) { HEIGHT * (PI * t / 0.01).sin().powi(2) } else { 0.0 }
}

/// Flow through the narrowing every half millisecond from 16 to 32 ms, with vessels of 12.5 cm in `n` cells: a wave arrives at 16.
fn arriving(n: usize, own: &[(&str, f64)]) -> Vec<f64> {
    let model = narrowed(12.5, n, 1.0);
    let theta = theta(&model, own);
    let mut x = start(&model, &theta);
    drive(&model, &theta, &mut x, 0..32, 5e-4, &pulse);
    let step = |k: usize| {
        drive(&model, &theta, &mut x, k..k + 1, 5e-4, &pulse);
        x[flow_at(&model)]
    };
    (32..64).map(step).collect()
}

#[test]
fn an_arriving_wave_pushes_blood_through_as_an_equation_of_the_flow_alone_says() {
    // E h/((1 − ν²) R0²) R0/(2ρ) with E = 5e6: the speed of small waves, and ρc/A.
    let c = (5e6 * 0.06 / 0.75 / RADIUS / (2.0 * RHO)).sqrt();
    let impedance = RHO * c / AREA;
    let own = [("severity", 0.99), ("p0", 0.0), ("mu", 1e-4), ("c_w", 0.0)];
    let [viscous, turbulent] = loss(0.99, 1.0, 1e-4);
    let inertance = 1.2 * RHO / AREA;
    // What waves bring from one side and take away on either: l dq/dt + a q + b |q| q + 2 Z q = 2 Z Q(t − x/c).
    let sampled = |t: f64| {
        let part = t / 5e-4;
        let (k, rest) = (part.floor(), part - part.floor());
        (1.0 - rest) * pulse(k * 5e-4) + rest * pulse((k + 1.0) * 5e-4)
    };
    let slope = |t: f64, q: f64| {
        (2.0 * impedance * (sampled(t - 12.5 / c) - q) - (viscous + turbulent * q.abs()) * q) / inertance
    };
    let (mut q, mut exact, h) = (0.0, Vec::new(), 1e-6);
    for i in 0..32_000 {
        let t = f64::from(i) * h;
        let (a, t) = (slope(t, q), t + 0.5 * h);
        let b = slope(t, q + 0.5 * h * a);
        let d = slope(t, q + 0.5 * h * b);
        q += h / 6.0 * (a + 2.0 * b + 2.0 * d + slope(t + 0.5 * h, q + h * d));
        if (i + 1) % 500 == 0 && i >= 16_000 {
            exact.push(q);
        }
    }
    let error = |n: usize| {
        let found = arriving(n, &own);
        assert_eq!(found.len(), exact.len());
        found.iter().zip(&exact).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / HEIGHT
    };
    let largest = exact.iter().copied().fold(0.0, f64::max);
    // The square is felt: what passes is far from what a plain junction lets through.
    assert!(largest < 0.8 * HEIGHT && turbulent * largest > 0.2 * impedance, "{largest}");
    let (coarse, fine) = (error(100), error(200));
    assert!(fine < 2e-3 && fine < coarse / 3.0, "{coarse} with 100 cells, {fine} with 200");
}

#[test]
fn without_severity_and_viscosity_it_is_a_junction_but_for_the_inertia_of_its_blood() {
    let plain = artery(layout(12.5, 200, &serde_json::json!({ "name": "narrow", "kind": "junction" })));
    let end = |model: &Artery1d, own: &[(&str, f64)]| {
        let theta = theta(model, own);
        let mut x = start(model, &theta);
        drive(model, &theta, &mut x, 0..70, 5e-4, &pulse);
        x[600..800].to_vec()
    };
    let through = end(&plain, &QUIET);
    let off = |part: f64| {
        let own: Vec<_> = QUIET.into_iter().chain([("severity", 0.0), ("K_u", 1.2 * part)]).collect();
        let found = end(&narrowed(12.5, 200, 0.2), &own);
        found.iter().zip(&through).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / HEIGHT
    };
    let (whole, quarter) = (off(1.0), off(0.25));
    // l/(2Z) = K_u L/(2c) is 1.7e-4 s, against 1.6 ms of a rad of the pulse.
    assert!(whole < 0.12 && (whole / quarter - 4.0).abs() < 0.4, "{whole} and {quarter}");
}

/// Pressures and flows around a narrowing between viscoelastic vessels, every 25 ms of a systole.
fn systole(n: usize) -> Vec<[f64; 4]> {
    let model = narrowed(10.0, n, 1.0);
    let theta = theta(&model, &[("severity", 0.85), ("c_w", 2e3), ("alpha", 1.1)]);
    let mut x = start(&model, &theta);
    let flow = |t: f64| 2.0 + 10.0 * (PI * t / 0.3).sin().powi(2);
    let run = |k: usize| {
        drive(&model, &theta, &mut x, 5 * k - 5..5 * k, 5e-3, &flow);
        let y = outputs(&model, &theta, &x, flow(k as f64 * 2.5e-2));
        let named = |name: &str| output(&model, &y, name);
        [x[flow_at(&model)], named("pressure_drop"), named("inlet_pressure"), named("outflow")]
    };
    (1..=12).map(run).collect()
}

#[test]
fn a_narrowing_between_viscoelastic_vessels_converges() {
    let [coarse, fine, reference] = [20, 40, 160].map(systole);
    let error = |of: &[[f64; 4]], i: usize| {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |a, b| a.max(b.abs()));
        let scale = largest(&mut reference.iter().map(|row| row[i]));
        largest(&mut of.iter().zip(&reference).map(|(a, b)| a[i] - b[i])) / scale
    };
    for i in 0..4 {
        let (coarse, fine) = (error(&coarse, i), error(&fine, i));
        assert!(coarse < 5e-3 && fine < coarse / 3.0, "{i}: {coarse:e} with 20 cells, {fine:e} with 40");
    }
}

#[test]
fn a_short_step_follows_the_rate_of_the_flow() {
    let model = narrowed(10.0, 10, 1.0);
    for c_w in [0.0, 2e3] {
        let theta = theta(&model, &[("severity", 0.9), ("c_w", c_w)]);
        let mut x = start(&model, &theta);
        drive(&model, &theta, &mut x, 0..100, 1e-3, &|t| 20.0 * (PI * t / 0.3).sin());
        let flow = 20.0 * (PI / 3.0).sin();
        let (dx, before, h, at) = (rate(&model, &theta, &x, flow), x.clone(), 1e-8, flow_at(&model));
        run(&model, &theta, &mut x, [0.0, h], [flow, flow]);
        let found = (x[at] - before[at]) / h;
        // Rates change within h by 1e-4 of themselves at most, differences lose half the digits.
        assert!((found / dx[at] - 1.0).abs() < 1e-3, "{found} against {}", dx[at]);
    }
}

#[test]
fn runs_in_pieces_are_runs_in_one_and_no_drop_is_lost() {
    let model = narrowed(10.0, 10, 1.0);
    for c_w in [0.0, 2e3] {
        let theta = theta(&model, &[("severity", 0.9), ("c_w", c_w)]);
        let flow = |t: f64| 10.0 + 10.0 * (PI * t / 0.3).sin();
        let mut x = start(&model, &theta);
        let before = model.volume(&x);
        let [inflow, outflow] = drive(&model, &theta, &mut x, 0..60, 1e-2, &flow);
        let mut pieces = start(&model, &theta);
        for i in 0..60 {
            let mut next = pieces.clone();
            drive(&model, &theta, &mut next, i..i + 1, 1e-2, &flow);
            pieces = next;
        }
        assert_eq!(x, pieces);
        let stored = model.volume(&x) - before;
        // Roundings of the 6 cm³ that passed.
        assert!((inflow - outflow - stored).abs() < 1e-12 * inflow, "{inflow} - {outflow} against {stored}");
    }
}

#[test]
fn flow_counts_out_of_the_segment_that_is_listed_first() {
    let node = serde_json::json!({ "name": "narrow", "kind": "stenosis", "length": 1.0 });
    let mut turned = layout(10.0, 10, &node);
    // Both vessels end in the node.
    turned["segments"][1]["from"] = serde_json::json!("leg");
    turned["segments"][1]["to"] = serde_json::json!("narrow");
    let (model, same) = (artery(turned), artery(layout(10.0, 10, &node)));
    let theta = theta(&model, &[("severity", 0.8)]);
    let (mut x, mut y) = (start(&model, &theta), start(&same, &theta));
    let flow = |t: f64| 10.0 * (PI * t / 0.3).sin();
    drive(&model, &theta, &mut x, 0..20, 1e-2, &flow);
    drive(&same, &theta, &mut y, 0..20, 1e-2, &flow);
    let at = flow_at(&model);
    // Roundings of sums in another order.
    assert!(x[at] > 1.0 && (x[at] - y[at]).abs() < 1e-9, "{} and {}", x[at], y[at]);
    assert!((0..10).all(|i| (x[30 + i] + y[39 - i]).abs() < 1e-8), "{:?}", &x[30..40]);
}

#[test]
fn a_narrowing_that_cannot_be_is_refused_with_its_place() {
    let node = |more: serde_json::Value| {
        let mut node = serde_json::json!({ "name": "narrow", "kind": "stenosis" });
        node.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        layout(10.0, 10, &node)
    };
    let cases = [
        (node(serde_json::json!({})), "nodes[1].length", "`narrow` has no length: give that of the stenosis"),
        (node(serde_json::json!({ "length": -1.0 })), "nodes[1].length", "above zero"),
        (node(serde_json::json!({ "length": 1.0, "kind": "junction" })), "nodes[1].length", "no stenosis"),
    ];
    for (layout, path, words) in cases {
        let (found, told) = refused(&layout);
        assert!(found == path && told.contains(words), "{found}: {told}");
    }
    let mut alone = node(serde_json::json!({ "length": 1.0 }));
    alone["segments"][1]["from"] = serde_json::json!("elsewhere");
    let (path, told) = refused(&alone);
    assert!(path == "nodes[1].name" && told.contains("1 segments meet at `narrow`"), "{path}: {told}");
}

#[test]
fn a_vessel_that_is_closed_is_an_error_that_says_so() {
    let model = narrowed(10.0, 10, 1.0);
    for severity in [1.0, 1.5, -0.1, f64::NAN] {
        let theta = theta(&model, &[("severity", severity)]);
        let mut x = start(&model, &theta);
        let segment = Segment {
            t0: 0.25,
            t1: 1.0,
            u0: &[1.0],
            slope: &[0.0],
            history: starlings_models_core::Drive::NONE.history,
            limits: &Limits::none(),
            noise: None,
        };
        let told = model.advance(segment, &theta, &mut x).unwrap_err().to_string();
        let words = ["the stenosis `narrow` has a severity of", "from 0 to 0.99", "`logit(0, 0.99)`"];
        assert!(words.iter().all(|words| told.contains(words)), "{told}");
    }
}
