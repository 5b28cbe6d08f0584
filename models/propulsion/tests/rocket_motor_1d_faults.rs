//! Faults at places along the bore against what the nozzle, the grain and a narrow place do to a lumped chamber.
#![allow(clippy::unwrap_used, missing_docs)]

mod bore;
mod kit;

use std::f64::consts::PI;

use bore::{C_0, FROZEN, Steady, motor, near};
use serde_json::json;

/// Pressure at the head and along the bore before and after a fault at 20 ms.
fn fault(n: usize, name: &str, parameters: &[(&'static str, f64)]) -> [Vec<f64>; 2] {
    let mut constants = FROZEN.to_vec();
    constants.extend(parameters);
    constants.push(("A_t", 3e-3));
    let mut outputs = vec!["pressure", "mass_flow"];
    if name == "breach" {
        outputs.push("breach_flow");
    }
    let mut rows = motor(json!({ "cells": n, "faults": [name] }), &constants, &outputs).run(&[0.015, 0.15]);
    [rows.remove(0), rows.remove(0)]
}

#[test]
fn a_breach_takes_the_choked_flow_of_its_place_and_the_pressure_falls() {
    let [before, after] =
        fault(40, "breach", &[("t_breach", 0.02), ("x_breach", 0.3), ("breach_area", 2e-4)]);
    let choked = Steady { gamma: 1.2, throat: 0.0, length: 1.0 }.choked();
    assert!(before[41].abs() < f64::MIN_POSITIVE);
    // Of the stagnation temperature of a flow of Mach 0.1 and the pressure at the place.
    near(after[41], choked * 1.2 * after[11] * 2e-4 / C_0, 3e-3);
    // A lumped chamber with a throat wider by the hole: (3.0/3.2)^{1/(1−n)}.
    near(after[0] / before[0], (3.0_f64 / 3.2).powf(1.0 / 0.6), 0.01);
}

#[test]
fn a_crack_raises_the_pressure_by_its_burning_surface() {
    let [before, after] = fault(40, "cracking", &[("t_crack", 0.02), ("crack_area", 0.031_415_926)]);
    // A lumped chamber burns a tenth more: 1.1^{1/(1−n)}.
    near(after[0] / before[0], 1.1_f64.powf(1.0 / 0.6), 0.01);
}

/// What burns before the narrow place has to pass it, as through a throat of its area.
#[test]
fn a_bore_that_chokes_is_a_throat_for_what_burns_before_it() {
    let narrow = |choke: f64| {
        let place = [("x_choke", 0.7), ("w_choke", 0.1), ("tau_choke", 0.005)];
        fault(80, "choking", &[&[("t_choke", 0.02), ("choke", choke)][..], &place].concat())
    };
    let [before, after] = narrow(0.85);
    let upstream = Steady { gamma: 1.2, throat: 0.15 * PI * 0.0025, length: 0.7 };
    // What burns in the narrow place, which is 0.2 m long, takes part on either side; 160 cells give 1 % more.
    near(after[0], upstream.lumped(), 0.05);
    assert!(after[0] > 2.0 * before[0] && after[79] < 0.55 * after[0], "{} {}", after[0], after[79]);
    // A flow that stays below the speed of sound passes with little loss: the pressure is low there and comes back.
    let [before, after] = narrow(0.4);
    assert!(after[55] / after[35] < 0.98 * before[55] / before[35], "{} {}", after[55], after[35]);
    near(after[76] / after[35], before[76] / before[35], 0.015);
}
