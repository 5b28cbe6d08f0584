//! Netlists, signals and runs shared by the tests of networks.
#![allow(clippy::unwrap_used, dead_code, reason = "test helpers; each test binary uses its part")]

use std::collections::BTreeMap;
use std::f64::consts::PI;

use serde_json::{Value, json};
use starlings_models::{BuildSetup, ModelDef, Prediction, Setup, Signal, Window};

use crate::common::run;

/// A setup of a netlist that predicts every output, all values being numbers or constants.
pub(crate) fn network(layout: Value, constants: &[(&str, f64)]) -> Setup {
    let constants: BTreeMap<String, f64> = constants.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect();
    let kind = "rcr-network".to_owned();
    let model = ModelDef { kind, constants, layout: Some(layout), ..ModelDef::default() };
    let mut setup = Setup { model, ..Setup::default() };
    setup.outputs = setup.spec().unwrap().outputs.iter().map(|q| q.name.clone()).collect();
    setup
}

pub(crate) fn signal(times: &[f64], value: impl Fn(f64) -> f64) -> Signal {
    Signal { times: times.to_vec(), values: times.iter().map(|t| value(*t)).collect() }
}

pub(crate) fn grid(n: usize, end: f64) -> Vec<f64> {
    (0..=n).map(|i| end * i as f64 / n as f64).collect()
}

pub(crate) fn over(setup: &Setup, times: Vec<f64>, inputs: Vec<Signal>) -> Window {
    Window::free(0.0, times, setup.outputs.len(), inputs)
}

/// The series of one output.
pub(crate) fn series(setup: &Setup, prediction: &Prediction, name: &str) -> Vec<f64> {
    let row = setup.outputs.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name}"));
    prediction.outputs.iter().skip(row).step_by(setup.outputs.len()).copied().collect()
}

pub(crate) fn simulate(setup: &Setup, times: &[f64], inputs: Vec<Signal>) -> BTreeMap<String, Vec<f64>> {
    let window = over(setup, times.to_vec(), inputs);
    let prediction = run(&*setup.build().unwrap(), &window, &[]);
    setup.outputs.iter().map(|name| (name.clone(), series(setup, &prediction, name))).collect()
}

pub(crate) fn flow_in(to: &str) -> Value {
    json!({ "name": "inflow", "kind": "flow", "to": to })
}

pub(crate) fn beat(t: f64) -> f64 {
    let phase = t.rem_euclid(0.8);
    if phase < 0.3 { 420.0 * (PI * phase / 0.3).sin() } else { 0.0 }
}

/// A network with every kind of element, with nodes that store nothing.
pub(crate) fn everything() -> Value {
    json!({
        "nodes": [{ "name": "lv", "initial": 10.0 }, { "name": "root" }, { "name": "asc", "initial": 70.0 },
                  { "name": "arch" }, { "name": "desc" }, { "name": "vein" }],
        "elements": [
            { "name": "filling", "kind": "flow", "to": "lv" },
            { "name": "ventricle", "kind": "C", "from": "lv", "value": 0.8, "input": "squeeze" },
            { "name": "valve", "kind": "diode", "from": "lv", "to": "root", "open": 0.02, "closed": 1e4 },
            { "name": "annulus", "kind": "R", "from": "root", "to": "asc", "value": 0.01 },
            { "name": "wall", "kind": "C", "from": "asc", "value": "C_wall" },
            { "name": "wall2", "kind": "C", "from": "0", "to": "asc", "value": "C_wall" },
            { "name": "blood", "kind": "L", "from": "asc", "to": "arch", "value": 0.002 },
            { "name": "coarctation", "kind": "loss", "from": "arch", "to": "desc", "linear": 0.02, "quadratic": 4e-4 },
            { "name": "head", "kind": "rcr", "from": "asc", "proximal": 0.3, "compliance": 0.2, "distal": 3.0 },
            { "name": "legs", "kind": "rcr", "from": "desc", "to": "vein", "proximal": 0.1, "compliance": 0.6, "distal": 1.2 },
            { "name": "coupling", "kind": "C", "from": "arch", "to": "desc", "value": 0.001 },
            { "name": "veins", "kind": "pressure", "to": "vein", "value": 6.0 },
        ],
    })
}
