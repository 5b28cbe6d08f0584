//! Stiffness by a model that did not make the data: the linear tube against waves of a nonlinear artery on a fine grid.
#![allow(clippy::unwrap_used)]
mod study_kit;

use std::f64::consts::PI;

use starlings_models::Model;
use starlings_models::limits::Limits;
use starlings_models::native::Artery1d;
use starlings_models::segment::{History, Segment};
use study_kit::{Done, csv, grid, normals, run_once};

/// Stiffness of the regions in octaves above the reference.
const OCTAVES: [f64; 5] = [0.5, 1.5, -0.5, 0.0, -1.0];
const MM_HG: f64 = 1333.22;
/// Cells of the estimator, and cells of the artery in each of them.
const CELLS: usize = 25;
const FINER: usize = 5;
/// Time between observations in s, observations in a beat, beats before the first observation and observed.
const EVERY: f64 = 0.01;
const BEAT: usize = 80;
const BEFORE: usize = 6;
const BEATS: usize = 3;

struct NoHistory;

impl History for NoHistory {
    fn at(&self, _: usize, _: f64) -> f64 {
        f64::NAN
    }
}

/// What is observed and in what vessel.
#[derive(Clone, Copy)]
struct Twin {
    /// Young's modulus of a region of zero octaves.
    young: f64,
    /// Largest inflow in cm³/s.
    peak: f64,
    /// Standard deviation of the noise, as a part of the largest pulse of the wall.
    noise: f64,
    /// Radius in cm from which displacements are measured, and that the estimator takes for the unloaded one of 1 cm.
    radius: f64,
}

/// Wall displacements at the estimator's cell centres, one row per observation, and the extremes of R/R0.
struct Wall {
    rows: Vec<Vec<f64>>,
    radius: [f64; 2],
    pulse: f64,
}

/// Half a sine of 0.3 s in every beat of 0.8 s, in samples of 1 ms.
fn inflow(sample: usize, peak: f64) -> f64 {
    let phase = (sample % (10 * BEAT)) as f64 * 1e-3;
    if phase < 0.3 { peak * (PI * phase / 0.3).sin() } else { 0.0 }
}

fn fine_artery() -> Artery1d {
    let layout = serde_json::json!({
        "segments": [{
            "name": "tube", "from": "inlet", "to": "outlet", "length": 25.0, "radius": 1.0, "thickness": 0.15,
            "cells": CELLS * FINER, "regions": 5,
        }],
        "nodes": [{ "name": "inlet", "kind": "inlet" }, { "name": "outlet", "kind": "rcr" }],
    });
    Artery1d::new(&serde_json::from_value(layout).unwrap()).unwrap()
}

impl Twin {
    fn theta(self, model: &Artery1d) -> Vec<f64> {
        let mut theta: Vec<f64> = model.spec().parameters.iter().map(|q| q.default.unwrap()).collect();
        for (young, octaves) in theta.iter_mut().zip(OCTAVES) {
            *young = self.young * octaves.exp2();
        }
        theta
    }

    /// Runs the artery until its beats repeat, then over the observed ones.
    fn wall(self) -> Wall {
        let model = fine_artery();
        let theta = self.theta(&model);
        let mut x = vec![0.0; model.spec().n_state()];
        model.initial(&theta, &mut x);
        let (mut rows, mut radius) = (Vec::new(), [f64::INFINITY, 0.0_f64]);
        let observe = |x: &[f64]| -> Vec<f64> {
            (0..CELLS).map(|cell| (x[cell * FINER + FINER / 2] / PI).sqrt() - 1.0).collect()
        };
        for sample in 0..10 * BEAT * (BEFORE + BEATS) {
            if sample == 10 * BEAT * BEFORE {
                rows.push(observe(&x));
            }
            let u0 = inflow(sample, self.peak);
            let slope = [(inflow(sample + 1, self.peak) - u0) / 1e-3];
            let times = [sample, sample + 1].map(|i| i as f64 * 1e-3);
            let segment = Segment {
                t0: times[0],
                t1: times[1],
                u0: &[u0],
                slope: &slope,
                history: &NoHistory,
                limits: &Limits::none(),
                noise: None,
            };
            model.advance(segment, &theta, &mut x).unwrap();
            if !rows.is_empty() && (sample + 1) % 10 == 0 {
                rows.push(observe(&x));
            }
        }
        let pulse = |cell: usize| {
            let of = rows.iter().map(|row| row[cell]);
            let [low, high] = [of.clone().fold(f64::INFINITY, f64::min), of.fold(0.0, f64::max)];
            radius = [radius[0].min(1.0 + low), radius[1].max(1.0 + high)];
            high - low
        };
        let pulse = (0..CELLS).map(pulse).fold(0.0, f64::max);
        Wall { rows, radius, pulse }
    }

    /// Fits the linear tube to the noisy wall.
    fn fit(self, wall: &Wall) -> Done {
        let (n, sd) = (wall.rows.len(), self.noise * wall.pulse);
        let errors = normals(n * CELLS, 3);
        let column = |cell: usize| -> Vec<f64> {
            (0..n).map(|i| wall.rows[i][cell] + (1.0 - self.radius) + sd * errors[i * CELLS + cell]).collect()
        };
        let columns: Vec<Vec<f64>> = std::iter::once(grid(n, EVERY)).chain((0..CELLS).map(column)).collect();
        let names: Vec<String> = (0..CELLS).map(|cell| format!("wall[{cell}]")).collect();
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let samples = 10 * BEAT * BEATS + 1;
        let flow: Vec<f64> = (0..samples).map(|i| inflow(i, self.peak)).collect();
        let files = [
            ("wall.csv", csv(&format!("time,{}", names.join(",")), &columns)),
            ("flow.csv", csv("time,flow", &[&grid(samples, 1e-3), &flow])),
        ];
        run_once(&self.study(sd), &files)
    }

    fn study(self, sd: f64) -> String {
        let young = |i: usize| {
            format!(
                "[[parameters]]\nname = \"E{i}\"\nprior = {{ transform = \"log2\", median = {:?}, sd = 1.0 }}\n",
                self.young
            )
        };
        format!(
            r#"
[study]
name = "no-inverse-crime"
[model]
kind = "fsi-tube"
constants = {{ R = {:?} }}
{}
[[parameters]]
name = "p0"
prior = {{ transform = "linear", median = {:?}, sd = {:?} }}
[[records]]
name = "wall"
file = "wall.csv"
inputs = {{ flow = "flow.csv:flow" }}
channels = [ {{ column = "wall", output = "displacement", noise = {sd:?} }} ]
[estimator]
passes = 3
"#,
            self.radius,
            (1..=5).map(young).collect::<String>(),
            80.0 * MM_HG,
            40.0 * MM_HG,
        )
    }

    /// Estimates over truth, region by region.
    fn found(self, done: &Done) -> Vec<f64> {
        let estimate = |i: usize| done.estimate(&format!("E{}", i + 1)).estimate;
        OCTAVES.iter().enumerate().map(|(i, o)| estimate(i) / (self.young * o.exp2())).collect()
    }
}

/// By how much the ratio of two regions is off at most, for estimates over truth.
fn ratios_off(found: &[f64]) -> f64 {
    let lowest = found.iter().copied().fold(f64::INFINITY, f64::min);
    found.iter().copied().fold(0.0, f64::max) / lowest - 1.0
}

#[test]
fn the_linear_tube_finds_the_stiffness_ratios_of_the_nonlinear_artery_and_says_what_it_misses() {
    let noisy = Twin { young: 5e6, peak: 300.0, noise: 0.1, radius: 1.0 };
    let wall = noisy.wall();
    // Not small: the radius is up to a third above that of the unloaded vessel, and the linear tube uses only the latter.
    assert!(wall.radius[0] > 1.0 && wall.radius[1] > 1.3, "{:?}", wall.radius);

    let done = noisy.fit(&wall);
    let found = noisy.found(&done);
    // Both walls are rings that are linear in their displacement, and the mean pressure is that of the known outlet: what is
    // nonlinear moves the ratios by less than noise of a tenth of the pulse, which is all that NIS shows.
    assert!(ratios_off(&found) < 0.1, "{found:?}");
    assert!(found.iter().all(|f| (f - 1.0).abs() < 0.02), "{found:?}");

    let exact = Twin { noise: 0.01, ..noisy };
    let done = exact.fit(&wall);
    let found = exact.found(&done);
    assert!(ratios_off(&found) < 0.1, "{found:?}");
    // Noise of a hundredth of the pulse shows that the model is another one, and NIS warns.
    let nis = done.summary.fit.nis_per_observation;
    assert!(nis > 3.0, "{nis}");
    for warning in
        ["far above 1", "the model does not explain the data at the stated noise", "are autocorrelated"]
    {
        assert!(done.warns(warning), "no `{warning}` in {:?}", done.summary.warnings);
    }
}

#[test]
fn a_radius_two_percent_off_spoils_the_ratios_and_no_residual_shows_it() {
    let twin = Twin { young: 5e6, peak: 300.0, noise: 0.1, radius: 1.02 };
    let done = twin.fit(&twin.wall());
    let found = twin.found(&done);
    // The stiffest region is displaced by 0.05 cm on average: two fifths of it are missing.
    assert!(ratios_off(&found) > 0.3 && found[1] > 1.5, "{found:?}");
    assert!(done.summary.fit.nis_per_observation < 1.2, "{}", done.summary.fit.nis_per_observation);
}
