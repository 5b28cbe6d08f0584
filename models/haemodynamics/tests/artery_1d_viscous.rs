//! The ends of viscoelastic vessels: against the closed form of the linear tube, and a nonlinear fork against a fine grid.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod artery_1d_kit;

use std::f64::consts::{PI, TAU};

use artery_1d_kit::{bifurcation, drive, output, outputs, start, theta, tube};
use nalgebra::Complex;

/// Period of the inflow in s, and its samples in a period, between which it is linear.
const PERIOD: f64 = 0.2;
const SAMPLES: i32 = 40;
/// What is read at the ends of the tube.
const ENDS: [&str; 3] = ["inlet_pressure", "outlet_pressure", "outflow"];
/// Resistances and compliance of the outlet: nearly without reflection, so that two periods forget the start.
const OUTLET: [(&str, f64); 3] = [("R_p", 150.0), ("R_d", 100.0), ("C", 1e-5)];

/// [`ENDS`] per inflow e^(iωt) of the tube of 25 cm, R = 1 cm, K = 1e6 dyn/cm³, ρ = 1.06 g/cm³, μ = 0.035 P, linear around
/// its rest without load (Womersley 1957; wall of Kelvin and Voigt).
fn response(c_w: f64, omega: f64) -> [Complex<f64>; 3] {
    let s = Complex::new(0.0, omega);
    let series = s * 1.06 / PI + 8.0 * 0.035 / PI;
    let shunt = s * TAU / (s * c_w + 1e6);
    let (gamma, impedance) = ((series * shunt).sqrt(), (series / shunt).sqrt());
    let [(_, proximal), (_, distal), (_, compliance)] = OUTLET;
    let load = (s * compliance + 1.0 / distal).inv() + proximal;
    let once = (-gamma * 25.0).exp();
    let back = (load - impedance) / (load + impedance) * once * once;
    let outflow = impedance * 2.0 * once / (load + impedance) / (-back + 1.0);
    [impedance * (back + 1.0) / (-back + 1.0), load * outflow, outflow]
}

/// The response at the samples of a sine that is linear between them: its harmonics 1 + mN have the heights
/// (sin(π/N)/(π/N))²/(1 + mN)², and at the samples all of them are in phase.
fn sampled_response(c_w: f64) -> [Complex<f64>; 3] {
    let n = f64::from(SAMPLES);
    let height = |k: f64| ((PI / n).sin() * n / PI).powi(2) / (k * k);
    let last = 10_000;
    let mut sum = [Complex::from(0.0); 3];
    for m in -last..=last {
        let k = f64::from(1 + m * SAMPLES);
        // Impedances grow as √k, so that terms fall as k^(−3/2): the last one times 2m is what follows it.
        let rest = if i32::abs(m) == last { 2.0 * f64::from(last) } else { 1.0 };
        for (sum, value) in sum.iter_mut().zip(response(c_w, k * TAU / PERIOD)) {
            *sum += value * height(k) * rest;
        }
    }
    sum
}

/// Largest errors of [`ENDS`] over a period, relative to their amplitudes, with the tube cut into `n` cells.
fn errors(c_w: f64, n: usize) -> [f64; 3] {
    let model = tube(n, 1, 1.0);
    let own: Vec<(&str, f64)> = OUTLET.into_iter().chain([("p0", 0.0), ("c_w", c_w)]).collect();
    let theta = theta(&model, &own);
    let mut x = start(&model, &theta);
    // Small: u/c is 1e-7.
    let flow = |t: f64| 1e-4 * (TAU * t / PERIOD).sin();
    let (exact, step, per) = (sampled_response(c_w), PERIOD / f64::from(SAMPLES), SAMPLES as usize);
    let mut errors = [0.0_f64; 3];
    drive(&model, &theta, &mut x, 0..2 * per, step, &flow);
    for sample in 2 * per..3 * per {
        drive(&model, &theta, &mut x, sample..sample + 1, step, &flow);
        let t = (sample + 1) as f64 * step;
        let y = outputs(&model, &theta, &x, flow(t));
        let phase = Complex::new(0.0, TAU * t / PERIOD).exp();
        for ((error, exact), name) in errors.iter_mut().zip(exact).zip(ENDS) {
            let found = output(&model, &y, name) / 1e-4;
            *error = error.max((found - (exact * phase).im).abs() / exact.norm());
        }
    }
    errors
}

#[test]
fn the_ends_of_a_viscoelastic_tube_converge_to_the_closed_form() {
    for c_w in [3e2, 3e3] {
        let [coarse, fine] = [25, 100].map(|n| errors(c_w, n));
        for ((coarse, fine), name) in coarse.into_iter().zip(fine).zip(ENDS) {
            // 5e-5 at the inlet, 2e-4 at the outlet with 25 cells. The viscous pressure at the inlet is a one-sided
            // difference: first order; the rest is of second, which 25 cells do not yet show.
            assert!(coarse < 3e-4, "{name}, c_w = {c_w}: {coarse:e} with 25 cells");
            assert!(fine < coarse / 5.0, "{name}, c_w = {c_w}: {coarse:e} with 25 cells, {fine:e} with 100");
        }
    }
}

/// Pressures and flows at the ends of a fork, and pressures at the junction brought there from its three vessels, every
/// 25 ms of a systole that starts with a jump of the flow.
fn fork(n: usize) -> Vec<[f64; 8]> {
    let model = bifurcation(n);
    let theta = theta(&model, &[("c_w", 3e3), ("E_left", 8e6), ("alpha", 1.1)]);
    let mut x = start(&model, &theta);
    let flow = |t: f64| 50.0 + 300.0 * (PI * t / 0.3).sin().powi(2);
    let at = |k: usize, x: &[f64]| {
        let y = outputs(&model, &theta, x, flow(k as f64 * 5e-3));
        let pressure = |cell: usize, next: usize| 1.5 * y[3 * n + cell] - 0.5 * y[3 * n + next];
        let named = |name: &str| output(&model, &y, name);
        [
            named("inlet_pressure"),
            named("outlet_pressure_left_leg"),
            named("outlet_pressure_right_leg"),
            named("outflow_left_leg"),
            named("outflow_right_leg"),
            pressure(n - 1, n - 2),
            pressure(n, n + 1),
            pressure(2 * n, 2 * n + 1),
        ]
    };
    let run = |k: usize| {
        drive(&model, &theta, &mut x, 5 * k - 5..5 * k, 5e-3, &flow);
        at(5 * k, &x)
    };
    (1..=12).map(run).collect()
}

#[test]
fn inlet_outlets_and_junction_of_a_viscoelastic_fork_converge() {
    let [coarse, fine, reference] = [25, 50, 200].map(fork);
    let error = |of: &[[f64; 8]], i: usize| {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |a, b| a.max(b.abs()));
        let scale = largest(&mut reference.iter().map(|row| row[i]));
        largest(&mut of.iter().zip(&reference).map(|(a, b)| a[i] - b[i])) / scale
    };
    for i in 0..8 {
        let (coarse, fine) = (error(&coarse, i), error(&fine, i));
        // 4e-5 at the inlet, up to 1e-3 elsewhere; an error of first order falls by 2, of second by 4.
        assert!(coarse < 2e-3 && fine < coarse / 1.9, "{i}: {coarse:e} with 25 cells, {fine:e} with 50");
    }
}
