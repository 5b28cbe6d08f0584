//! What a segment of an arterial network may say of its wall and its profile, against the law of the wall and the friction.
#![allow(clippy::unwrap_used)]

mod artery_1d_kit;

use std::f64::consts::PI;

use artery_1d_kit::{artery, run, start, theta};
use starlings_haemodynamics::Artery1d;

/// A tube of 10 cm and radius 1 cm in ten cells, with more keys.
fn tube(more: &[(&str, f64)]) -> Artery1d {
    let mut segment = serde_json::json!({
        "name": "tube", "from": "heart", "to": "out", "length": 10.0, "radius": 1.0, "thickness": 0.2, "cells": 10,
    });
    for (key, value) in more {
        segment[key] = serde_json::json!(value);
    }
    artery(serde_json::json!({
        "segments": [segment],
        "nodes": [{ "name": "heart", "kind": "inlet" }, { "name": "out", "kind": "rcr" }],
    }))
}

#[test]
fn a_wall_that_gets_thinner_is_as_wide_as_its_law_says() {
    let model = tube(&[("thickness_to", 0.1)]);
    let (young, pressure) = (5e6, 1e5);
    let x = start(&model, &theta(&model, &[("E1", young), ("nu", 0.5), ("p0", pressure)]));
    for (cell, area) in x[..10].iter().enumerate() {
        let thickness = 0.2 - 0.01 * (cell as f64 + 0.5);
        // p = E h/((1 − ν²) R0²) (R − R0) with R0 = 1.
        let radius = 1.0 + pressure * 0.75 / (young * thickness);
        // A few roundings.
        assert!((area / (PI * radius * radius) - 1.0).abs() < 1e-13, "cell {cell}: {area}");
    }
}

/// Constants of the systemic arteries (Olufsen 1999), in cgs units.
const OLUFSEN: [(&str, f64); 3] = [("k1", 2e7), ("k2", -22.53), ("k3", 8.65e5)];

#[test]
fn a_wall_of_olufsens_law_is_as_stiff_as_its_radius_says() {
    let law = |k: [(&str, f64); 3]| serde_json::json!({ k[0].0: k[0].1, k[1].0: k[1].1, k[2].0: k[2].1 });
    let layout = |wall: serde_json::Value| {
        serde_json::json!({
            "segments": [{
                "name": "leg", "from": "heart", "to": "out", "length": 10.0, "radius": 0.4, "radius_to": 0.2,
                "thickness": 0.05, "cells": 10, "wall": wall,
            }],
            "nodes": [{ "name": "heart", "kind": "inlet" }, { "name": "out", "kind": "rcr" }],
        })
    };
    let model = artery(layout(law(OLUFSEN)));
    let (pressure, multiple) = (1e5, 1.5);
    let x = start(&model, &theta(&model, &[("stiffness1", multiple), ("nu", 0.5), ("p0", pressure)]));
    for (cell, area) in x[..10].iter().enumerate() {
        let r0 = 0.4 - 0.02 * (cell as f64 + 0.5);
        // p = 4/3 (E h/R0) (R − R0)/R0.
        let eh_by_r0 = multiple * (2e7 * (-22.53 * r0).exp() + 8.65e5);
        let radius = r0 + pressure * r0 / (4.0 / 3.0 * eh_by_r0);
        // A few roundings.
        assert!((area / (PI * radius * radius) - 1.0).abs() < 1e-13, "cell {cell}: {area}");
    }
    let none = Artery1d::new(
        &serde_json::from_value(layout(law([("k1", 1.0), ("k2", 0.0), ("k3", -1.0)]))).unwrap(),
    );
    let told = none.err().unwrap().to_string();
    assert!(told.contains("segments[0].wall") && told.contains("give a law above zero"), "{told}");
}

#[test]
fn a_flat_profile_rubs_as_a_parabola_of_a_more_viscous_blood() {
    let end = |model: &Artery1d, mu: f64| {
        let theta = theta(model, &[("mu", mu), ("p0", 1e5)]);
        let mut x = start(model, &theta);
        run(model, &theta, &mut x, [0.0, 0.1], [0.0, 100.0]);
        x
    };
    // 2(ζ + 2)πμ: with ζ = 9 that of 11/4 of the viscosity.
    let (flat, viscous, thin) =
        (end(&tube(&[("profile", 9.0)]), 0.04), end(&tube(&[]), 0.11), end(&tube(&[]), 0.04));
    let most = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs() / (1.0 + a.abs())))
    };
    // Roundings of the factor, carried through the steps.
    assert!(most(&flat, &viscous) < 1e-10, "{}", most(&flat, &viscous));
    assert!(most(&flat, &thin) > 1e-4, "friction is felt: {}", most(&flat, &thin));
}
