//! Several narrowings in a network: each has quantities and a loss of its own.
#![allow(clippy::unwrap_used)]

mod artery_1d_kit;

use artery_1d_kit::{artery, output, outputs, run, start, theta, young_tsai};
use starlings_haemodynamics::Artery1d;
use starlings_models_core::Model;

/// Two stenoses in vessels that taper, before a fork of two outlets; the segments before the first and behind the fork remember.
fn two_in_a_row() -> Artery1d {
    let vessel = |name: &str, ends: [&str; 2], radii: [f64; 2], friction: &str, regions: usize| {
        serde_json::json!({
            "name": name, "from": ends[0], "to": ends[1], "length": 10.0, "radius": radii[0], "radius_to": radii[1],
            "thickness": 0.06, "cells": 10, "friction": friction, "regions": regions,
        })
    };
    artery(serde_json::json!({
        "segments": [
            vessel("a", ["heart", "s1"], [0.4, 0.3], "womersley", 2),
            vessel("b", ["s1", "s2"], [0.2, 0.25], "steady", 1),
            // It ends at the stenosis.
            vessel("c", ["fork", "s2"], [0.35, 0.3], "steady", 1),
            vessel("d", ["fork", "left"], [0.25, 0.25], "womersley", 1),
            vessel("e", ["fork", "right"], [0.2, 0.2], "womersley", 1),
        ],
        "nodes": [
            { "name": "heart", "kind": "inlet" },
            { "name": "s1", "kind": "stenosis", "length": 1.0 },
            { "name": "s2", "kind": "stenosis", "length": 2.0 },
            { "name": "left", "kind": "rcr" },
            { "name": "right", "kind": "rcr" },
        ],
    }))
}

#[test]
fn two_stenoses_among_segments_that_remember_have_quantities_and_losses_of_their_own() {
    let model = two_in_a_row();
    let sized = |of: &[starlings_models_core::Quantity]| -> Vec<(String, usize)> {
        of.iter().map(|q| (q.name.clone(), q.size)).collect()
    };
    let named = |names: &[(&str, usize)]| -> Vec<(String, usize)> {
        names.iter().map(|(name, size)| ((*name).to_owned(), *size)).collect()
    };
    // Ten states in each of the thirty cells that remember.
    let states =
        [("A", 50), ("Q", 50), ("pi_left", 1), ("pi_right", 1), ("q_s1", 1), ("q_s2", 1), ("w", 300)];
    assert_eq!(sized(&model.spec().states), named(&states));
    let parameters = sized(&model.spec().parameters);
    for stem in ["severity", "K_t", "K_u"] {
        assert!(["s1", "s2"].iter().all(|s| parameters.contains(&(format!("{stem}_{s}"), 1))), "{stem}");
    }
    for c_w in [0.0, 2e3] {
        let own = [
            ("severity_s1", 0.5),
            ("severity_s2", 0.8),
            ("c_w", c_w),
            ("p0", 1e5),
            ("p_venous", 1e5),
            ("mu", 0.04),
            ("C_left", 1e-6),
            ("C_right", 1e-6),
            ("R_d_right", 2e4),
        ];
        let theta = theta(&model, &own);
        let mut x = start(&model, &theta);
        run(&model, &theta, &mut x, [0.0, 0.5], [0.0, 3.0]);
        run(&model, &theta, &mut x, [0.5, 8.0], [3.0, 3.0]);
        let y = outputs(&model, &theta, &x, 3.0);
        // Half of the radii 0.3 and 0.2, 0.25 and 0.3 on their two sides.
        for (name, radius, severity, length) in [("s1", 0.25, 0.5, 1.0), ("s2", 0.275, 0.8, 2.0)] {
            let [viscous, turbulent] = young_tsai(radius, severity, length, 0.04);
            let wanted = (viscous + turbulent * 3.0) * 3.0;
            let found = output(&model, &y, &format!("pressure_drop_{name}"));
            // Steady to roundings of pressures of 1e5.
            assert!((found - wanted).abs() < 1e-9 * wanted.abs() + 1e-5, "{name}: {found} against {wanted}");
        }
        let [left, right] = ["outflow_left", "outflow_right"].map(|name| output(&model, &y, name));
        assert!((left + right - 3.0).abs() < 1e-8 && left > 1.2 * right, "{left} {right}");
    }
}
