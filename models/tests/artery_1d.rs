//! The arterial network against closed forms: wave speed, order, mass, states of rest, junctions.
#![allow(clippy::float_cmp)]

use std::f64::consts::PI;

use starlings_models::model::{Drive, History, Segment};
use starlings_models::native::Artery1d;
use starlings_models::{Model, ModelDef, Spec, native};

struct NoHistory;

impl History for NoHistory {
    fn at(&self, _: usize, _: f64) -> f64 {
        f64::NAN
    }
}

fn artery(layout: serde_json::Value) -> Artery1d {
    Artery1d::new(&serde_json::from_value(layout).unwrap()).unwrap()
}

fn tube(cells: usize, regions: usize, radius_to: f64) -> Artery1d {
    artery(serde_json::json!({
        "segments": [{
            "name": "tube", "from": "inlet", "to": "outlet", "length": 25.0, "radius": 1.0, "radius_to": radius_to,
            "thickness": 0.15, "cells": cells, "regions": regions,
        }],
        "nodes": [{ "name": "inlet", "kind": "inlet" }, { "name": "outlet", "kind": "rcr" }],
    }))
}

/// The defaults with some values of their own.
fn theta(model: &Artery1d, own: &[(&str, f64)]) -> Vec<f64> {
    let parameters = &model.spec().parameters;
    let mut theta: Vec<f64> = parameters.iter().map(|q| q.default.unwrap()).collect();
    for (name, value) in own {
        theta[parameters.iter().position(|q| q.name == *name).unwrap()] = *value;
    }
    theta
}

fn start(model: &Artery1d, theta: &[f64]) -> Vec<f64> {
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(theta, &mut x);
    x
}

/// Advances from t0 to t1 with a flow linear in between.
fn run(model: &Artery1d, theta: &[f64], x: &mut [f64], [t0, t1]: [f64; 2], flow: [f64; 2]) -> [f64; 2] {
    let slope = [(flow[1] - flow[0]) / (t1 - t0)];
    let segment = Segment { t0, t1, u0: &flow[..1], slope: &slope, history: &NoHistory };
    let volumes = model.advance_counting(segment, theta, x).unwrap();
    [volumes.inflow, volumes.outflow]
}

fn outputs(model: &Artery1d, theta: &[f64], x: &[f64], flow: f64) -> Vec<f64> {
    let mut y = vec![f64::NAN; model.spec().n_output()];
    let drive = Drive { value: &[flow], slope: &[0.0], history: &NoHistory };
    model.output(0.0, x, theta, drive, &mut y);
    y
}

fn output(model: &Artery1d, y: &[f64], name: &str) -> f64 {
    y[Spec::offset(&model.spec().outputs, name).unwrap()]
}

/// A rise of pressure around the middle of the tube that lets the wave travel towards the outlet only.
fn pulse(model: &Artery1d, theta: &[f64], height: f64, width: f64) -> Vec<f64> {
    let mut x = start(model, theta);
    let n = (x.len() - 1) / 2;
    let dx = 25.0 / n as f64;
    // Mean of the Gaussian over a cell to fourth order, so that grids of all widths start from the same function.
    let gauss = |s: f64| (-0.5 * ((s - 12.5) / width).powi(2)).exp();
    for i in 0..n {
        let s = (i as f64 + 0.5) * dx;
        let mean = |f: &dyn Fn(f64) -> f64| {
            let d = 0.5 * dx * 0.6_f64.sqrt();
            (5.0 * f(s - d) + 8.0 * f(s) + 5.0 * f(s + d)) / 18.0
        };
        let area = |s: f64| PI * (1.0 + height * gauss(s)).powi(2);
        let c = |s: f64| (1e6 * (1.0 + height * gauss(s)) / 2.12).sqrt();
        let c0 = (1e6_f64 / 2.12).sqrt();
        x[i] = mean(&area);
        // u - 4c is the same everywhere.
        x[n + i] = mean(&|s| area(s) * 4.0 * (c(s) - c0));
    }
    x
}

const QUIET: [(&str, f64); 3] = [("p0", 0.0), ("mu", 0.0), ("c_w", 0.0)];

/// Means of a fine field over the cells of a coarse one.
fn averaged(fine: &[f64], n: usize) -> Vec<f64> {
    fine.chunks(fine.len() / n).map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64).collect()
}

fn orders(own: &[(&str, f64)], height: f64, width: f64) -> Vec<f64> {
    let run_on = |cells: usize| {
        let model = tube(cells, 1, 1.0);
        let theta = theta(&model, own);
        let mut x = pulse(&model, &theta, height, width);
        run(&model, &theta, &mut x, [0.0, 0.008], [0.0, 0.0]);
        x
    };
    let grids = [50, 100, 200, 400];
    let finest = run_on(3200);
    let errors: Vec<f64> = grids
        .iter()
        .map(|&n| {
            let (x, exact) = (run_on(n), averaged(&finest[..3200], n));
            x.iter().zip(&exact).map(|(a, b)| (a - b).abs()).sum::<f64>() / n as f64
        })
        .collect();
    eprintln!("{errors:?}");
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

#[test]
fn a_smooth_pulse_converges_at_second_order() {
    eprintln!("orders {:?}", orders(&QUIET, 0.05, 1.5));
    eprintln!("orders viscous {:?}", orders(&[("p0", 0.0)], 0.05, 1.5));
}

#[test]
fn a_network_at_rest_stays_at_rest() {
    let model = tube(20, 5, 0.6);
    let theta = theta(&model, &[("E2", 1e7), ("E4", 3e6), ("p0", 1e5), ("p_venous", 1e5)]);
    let mut x = start(&model, &theta);
    let first = x.clone();
    run(&model, &theta, &mut x, [0.0, 1.0], [0.0, 0.0]);
    let moved = x[..20].iter().zip(&first).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    let flow = x[20..40].iter().map(|q| q.abs()).fold(0.0, f64::max);
    eprintln!("rest: {moved:e} {flow:e} {:e}", x[40] - 1e5);
}

#[test]
fn every_drop_is_accounted_for() {
    let model = tube(20, 5, 0.8);
    let theta = theta(&model, &[]);
    let mut x = start(&model, &theta);
    let clock = std::time::Instant::now();
    for beat in 0..3 {
        for i in 0..80 {
            let flow = |t: f64| if t < 0.3 { 300.0 * (PI * t / 0.3).sin() } else { 0.0 };
            let [t0, t1] = [f64::from(i) * 0.01, f64::from(i + 1) * 0.01];
            run(&model, &theta, &mut x, [t0, t1], [flow(t0), flow(t1)]);
            if beat == 2 && i % 10 == 0 {
                let y = outputs(&model, &theta, &x, flow(t1));
                eprintln!(
                    "{t1:.2} in {:.2} out {:.2} flow {:.2} eta {:.4} {:.4}",
                    output(&model, &y, "inlet_pressure") / 1333.22,
                    output(&model, &y, "outlet_pressure") / 1333.22,
                    output(&model, &y, "outflow"),
                    y[0],
                    y[19]
                );
            }
        }
    }
    eprintln!("3 beats in {:?}", clock.elapsed());
}
