//! Motion in time: closed forms, energy, and what damps it.

use serde_json::json;
use starlings_models_core::limits::Limits;
use starlings_models_core::segment::{History, Segment};

use crate::kit::Toy;

struct NoHistory;

impl History for NoHistory {
    fn at(&self, _: usize, _: f64) -> f64 {
        f64::NAN
    }
}

/// The state a time `h` after `x`, without input.
fn advanced(toy: &Toy, x: &[f64], h: f64, flow: [f64; 2]) -> Vec<f64> {
    let n_input = toy.model.spec().inputs.len();
    let (u0, slope) = (&flow[..n_input], &flow[1..=n_input]);
    let mut x = x.to_vec();
    let segment =
        Segment { t0: 0.0, t1: h, u0, slope, history: &NoHistory, limits: &Limits::none(), noise: None };
    toy.model.advance(segment, &toy.theta, &mut x).unwrap();
    x
}

fn initial(toy: &Toy) -> Vec<f64> {
    let mut x = vec![0.0; toy.model.spec().n_state()];
    toy.model.initial(&toy.theta, &mut x);
    x
}

/// ½ dᵀ K d + ½ cᵀ M c.
fn energy(toy: &Toy, x: &[f64]) -> f64 {
    let blocks = toy.blocks();
    let of = |matrix: &nalgebra::DMatrix<f64>, first: usize| {
        let part = nalgebra::DVector::from_column_slice(&x[first..first + matrix.nrows()]);
        0.5 * part.dot(&(matrix * &part))
    };
    of(&blocks.stiffness, blocks.displacement) + of(&blocks.mass, blocks.velocity)
}

#[test]
fn the_bump_moves_as_three_cosines_in_time() {
    let toy = Toy::new("toy-fsi", json!({ "modes": 12 }), &[("bump", 0.2)]);
    let t = 0.0713;
    let x = advanced(&toy, &initial(&toy), t, [0.0; 2]);
    let omega = [301.110_657_51, 582.062_647_96, 836.798_907_92];
    for j in 0..12 {
        let xi = f64::from(j + 1) / 13.0;
        let mode = |i: usize, height: f64| {
            height * ((i as f64) * std::f64::consts::PI * xi).sin() * (omega[i - 1] * t).cos()
        };
        let expected = mode(1, 0.2) + mode(2, 0.1) + mode(3, 0.05);
        // Frequencies of eleven digits over sixty radians.
        assert!((x[j as usize] - expected).abs() < 1e-9, "node {j}: {} for {expected}", x[j as usize]);
    }
}

#[test]
fn without_damping_the_energy_of_a_potential_flow_is_conserved() {
    for layout in [
        json!({ "modes": 15 }),
        json!({ "discretisation": "elements", "cells": [16, 4], "thickness_wave": 0.5 }),
    ] {
        let toy = Toy::new("toy-fsi", layout, &[]);
        let start = initial(&toy);
        let mut x = start.clone();
        (0..50).for_each(|_| x = advanced(&toy, &x, 0.013, [0.0; 2]));
        let ratio = energy(&toy, &x) / energy(&toy, &start);
        // Fifty rotations, each rounding in sums of fifteen terms.
        assert!((ratio - 1.0).abs() < 1e-12, "{ratio}");
    }
}

#[test]
fn a_retarded_wall_damps_each_mode_by_half_its_stiffness_rate() {
    let tau = 2e-5;
    for (kind, layout) in [
        ("toy-fsi", json!({ "modes": 8 })),
        ("toy-fsi", json!({ "discretisation": "elements", "cells": [9, 3], "thickness_wave": 0.5 })),
    ] {
        let (free, damped) = (Toy::new(kind, layout.clone(), &[]), Toy::new(kind, layout, &[("tau", tau)]));
        let upper = |toy: &Toy| toy.poles().into_iter().filter(|p| p.im > 0.0).collect::<Vec<_>>();
        for (free, damped) in upper(&free).iter().zip(upper(&damped)) {
            // λ² + τ ω² λ + ω² = 0.
            let (square, half) = (free.im * free.im, 0.5 * tau * free.im * free.im);
            let expected = nalgebra::Complex::new(-half, (square - half * half).sqrt());
            assert!((damped - expected).norm() < 1e-9 * free.im, "{damped} for {expected}");
        }
    }
}

#[test]
fn viscosity_only_takes_energy_and_a_retarded_wall_takes_more() {
    let layout = json!({ "modes": 5, "polynomials": 10 });
    let left = |changed: &[(&str, f64)]| {
        let toy = Toy::new("toy-fsi-stokes", layout.clone(), changed);
        let (start, mut x) = (initial(&toy), initial(&toy));
        let mut before = energy(&toy, &x);
        for _ in 0..20 {
            x = advanced(&toy, &x, 0.001, [0.0; 2]);
            let now = energy(&toy, &x);
            assert!(now <= before * (1.0 + 1e-12), "{now} after {before}");
            before = now;
        }
        before / energy(&toy, &start)
    };
    let (inviscid, viscous, retarded) = (left(&[("mu", 0.0)]), left(&[]), left(&[("tau", 1e-4)]));
    assert!((inviscid - 1.0).abs() < 1e-12, "{inviscid}");
    assert!(viscous < 0.99 && retarded < 0.8 * viscous, "{viscous} {retarded}");
}

#[test]
fn what_flows_in_is_in_the_vessel_in_the_windkessel_or_has_flowed_out() {
    let toy = Toy::new("toy-fsi-windkessel", json!({ "modes": 10 }), &[]);
    let (n, steps, h) = (10, 4000, 1e-4);
    let (distal, compliance) = (toy.theta[10], toy.theta[11]);
    // Sᵀ d by the rate of π under a velocity d.
    let volume = |d: &[f64]| {
        let mut x = vec![0.0; 2 * n + 1];
        x[n..2 * n].copy_from_slice(d);
        let mut dx = vec![0.0; 2 * n + 1];
        let drive = starlings_models_core::Drive {
            value: &[0.0],
            slope: &[0.0],
            ..starlings_models_core::Drive::NONE
        };
        toy.model.rhs(0.0, &x, &toy.theta, drive, &mut dx);
        -compliance * dx[2 * n]
    };
    let start = initial(&toy);
    let (mut x, mut out) = (start.clone(), 0.0);
    for i in 0..steps {
        let slope = 500.0;
        let next = advanced(&toy, &x, h, [slope * h * f64::from(i), slope]);
        // Simpson's rule between the steps would do no better: π is smooth over 0.1 ms.
        out += 0.5 * h * (x[2 * n] + next[2 * n]) / distal;
        x = next;
    }
    let flowed_in = 0.5 * 500.0 * (f64::from(steps) * h).powi(2);
    let kept = volume(&x[..n]) - volume(&start[..n]) + compliance * (x[2 * n] - start[2 * n]);
    // The trapezium's error is h² π″/12 per time.
    assert!((flowed_in - out - kept).abs() < 1e-5 * flowed_in, "{flowed_in} {out} {kept}");
}
