//! Arterial networks for tests, and ways to run and read them.
#![allow(clippy::unwrap_used, dead_code, reason = "test helpers; each test binary uses its part")]

use std::f64::consts::PI;

use starlings_haemodynamics::{Artery1d, MODELS};
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::{Drive, History, Segment};
use starlings_models_core::{Model, ModelDef, SetupError, Spec};

struct NoHistory;

impl History for NoHistory {
    fn at(&self, _: usize, _: f64) -> f64 {
        f64::NAN
    }
}

/// No load, no friction, no viscosity of the wall.
pub(crate) const QUIET: [(&str, f64); 3] = [("p0", 0.0), ("mu", 0.0), ("c_w", 0.0)];

/// Density of the blood.
pub(crate) const RHO: f64 = 1.06;

/// Resistance, and factor of q|q|, of the loss of a stenosis in vessels of this radius (Young and Tsai 1973), with K_t = 1.52.
pub(crate) fn young_tsai(radius: f64, severity: f64, length: f64, mu: f64) -> [f64; 2] {
    let (ratio, area) = (1.0 / (1.0 - severity), PI * radius * radius);
    let along = 0.83 * length + 1.64 * 2.0 * radius / ratio.sqrt();
    let viscous = 32.0 * along / (2.0 * radius) * ratio * ratio;
    [viscous * mu / (2.0 * PI * radius.powi(3)), 1.52 * RHO / (2.0 * area * area) * (ratio - 1.0).powi(2)]
}

/// Speed of small waves in a wall of E = 5e6, h = 0.15, ν = 1/2 around a radius of 1: K = 1e6, ρ = 1.06.
pub(crate) fn speed() -> f64 {
    (1e6_f64 / 2.12).sqrt()
}

pub(crate) fn artery(layout: serde_json::Value) -> Artery1d {
    Artery1d::new(&serde_json::from_value(layout).unwrap()).unwrap()
}

/// A tube of 25 cm with radius 1 cm at its inlet and an RCR outlet.
pub(crate) fn tube(cells: usize, regions: usize, radius_to: f64) -> Artery1d {
    artery(serde_json::json!({
        "segments": [{
            "name": "tube", "from": "inlet", "to": "outlet", "length": 25.0, "radius": 1.0, "radius_to": radius_to,
            "thickness": 0.15, "cells": cells, "regions": regions,
        }],
        "nodes": [{ "name": "inlet", "kind": "inlet" }, { "name": "outlet", "kind": "rcr" }],
    }))
}

/// The tube of 25 cm again, and two daughters of 25 cm behind it.
pub(crate) fn bifurcation(cells: usize) -> Artery1d {
    let vessel = |name: &str, from: &str, to: &str, radius: f64| {
        serde_json::json!({
            "name": name, "from": from, "to": to, "length": 25.0, "radius": radius, "thickness": 0.15, "cells": cells,
        })
    };
    artery(serde_json::json!({
        "segments": [
            vessel("aorta", "heart", "fork", 1.0),
            vessel("left", "fork", "left_leg", 0.7),
            vessel("right", "fork", "right_leg", 0.6),
        ],
        "nodes": [
            { "name": "heart", "kind": "inlet" },
            { "name": "left_leg", "kind": "rcr" },
            { "name": "right_leg", "kind": "resistance" },
        ],
    }))
}

/// The defaults with some values of their own.
pub(crate) fn theta(model: &Artery1d, own: &[(&str, f64)]) -> Vec<f64> {
    let parameters = &model.spec().parameters;
    let mut theta: Vec<f64> = parameters.iter().map(|q| q.default.unwrap()).collect();
    for (name, value) in own {
        theta[parameters.iter().position(|q| q.name == *name).unwrap()] = *value;
    }
    theta
}

pub(crate) fn start(model: &Artery1d, theta: &[f64]) -> Vec<f64> {
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(theta, &mut x);
    x
}

/// Advances over a time in which the flow goes linearly from one value to another; returns the volumes in and out.
pub(crate) fn run(
    model: &Artery1d,
    theta: &[f64],
    x: &mut [f64],
    times: [f64; 2],
    flow: [f64; 2],
) -> [f64; 2] {
    run_inlets(model, theta, x, times, [&flow[..1], &flow[1..]])
}

/// The same with a flow at each of several inlets.
pub(crate) fn run_inlets(
    model: &Artery1d,
    theta: &[f64],
    x: &mut [f64],
    [t0, t1]: [f64; 2],
    flows: [&[f64]; 2],
) -> [f64; 2] {
    let slope: Vec<f64> = flows[0].iter().zip(flows[1]).map(|(from, to)| (to - from) / (t1 - t0)).collect();
    let segment = Segment {
        t0,
        t1,
        u0: flows[0],
        slope: &slope,
        history: &NoHistory,
        limits: &Limits::none(),
        noise: None,
    };
    let volumes = model.advance_counting(segment, theta, x).unwrap();
    [volumes.inflow, volumes.outflow]
}

/// Advances over a signal sampled every `step`, from `from` to `to` samples; returns the volumes in and out.
pub(crate) fn drive(
    model: &Artery1d,
    theta: &[f64],
    x: &mut [f64],
    samples: std::ops::Range<usize>,
    step: f64,
    flow: &dyn Fn(f64) -> f64,
) -> [f64; 2] {
    let mut volumes = [0.0; 2];
    for i in samples {
        let times = [i as f64 * step, (i + 1) as f64 * step];
        let [inflow, outflow] = run(model, theta, x, times, times.map(flow));
        volumes[0] += inflow;
        volumes[1] += outflow;
    }
    volumes
}

pub(crate) fn rate(model: &Artery1d, theta: &[f64], x: &[f64], flow: f64) -> Vec<f64> {
    let mut dx = vec![f64::NAN; x.len()];
    model.rhs(0.0, x, theta, Drive { value: &[flow], slope: &[0.0], history: &NoHistory }, &mut dx);
    dx
}

pub(crate) fn outputs(model: &Artery1d, theta: &[f64], x: &[f64], flow: f64) -> Vec<f64> {
    outputs_inlets(model, theta, x, &[flow])
}

/// The same with a flow at each of several inlets.
pub(crate) fn outputs_inlets(model: &Artery1d, theta: &[f64], x: &[f64], flows: &[f64]) -> Vec<f64> {
    let none = vec![0.0; flows.len()];
    let mut y = vec![f64::NAN; model.spec().n_output()];
    model.output(0.0, x, theta, Drive { value: flows, slope: &none, history: &NoHistory }, &mut y);
    y
}

pub(crate) fn output(model: &Artery1d, y: &[f64], name: &str) -> f64 {
    y[Spec::offset(&model.spec().outputs, name).unwrap()]
}

/// Place and message of the refusal of a layout.
pub(crate) fn refused(layout: &serde_json::Value) -> (String, String) {
    let def = ModelDef { kind: "artery-1d".to_owned(), layout: Some(layout.clone()), ..ModelDef::default() };
    let kind = MODELS.iter().find(|kind| kind.kind == "artery-1d").unwrap();
    match (kind.build)(&def).map(|_| ()) {
        Err(SetupError::Layout { path, message }) => (path, message),
        other => panic!("{other:?} for {layout}"),
    }
}
