//! Ten beats of a three-element Windkessel in cgs units: a half sine of flow, pressure every 10 ms.

use std::f64::consts::PI;

use super::{csv, normals};

pub const MM_HG: f64 = 1333.22;
/// Zc, R in dyn s/cm⁵, C in cm⁵/dyn.
pub const TRUTH: [f64; 3] = [150.0, 1850.0, 1e-3];

fn flow(step: usize) -> f64 {
    let phase = (step % 800) as f64 * 1e-3;
    if phase < 0.3 { 300.0 * (PI * phase / 0.3).sin() } else { 0.0 }
}

/// Distal pressure one millisecond later, exact for the mean flow.
fn advance(p: f64, step: usize) -> f64 {
    let e = (-1e-3 / (TRUTH[1] * TRUTH[2])).exp();
    e * p + (1.0 - e) * TRUTH[1] * 0.5 * (flow(step) + flow(step + 1))
}

/// `flow.csv` and `pressure.csv`; noise in mmHg.
pub fn files(noise: f64, seed: u64) -> [(&'static str, String); 2] {
    let driven = (0..800).fold(0.0, advance);
    let mut p = driven / (1.0 - (-0.8 / (TRUTH[1] * TRUTH[2])).exp());
    let (mut times, mut pressure) = (Vec::new(), Vec::new());
    for step in 0..=8000 {
        if step % 10 == 0 {
            times.push(step as f64 / 1000.0);
            pressure.push(p + TRUTH[0] * flow(step));
        }
        p = advance(p, step);
    }
    for (z, e) in pressure.iter_mut().zip(normals(times.len(), seed)) {
        *z += noise * MM_HG * e;
    }
    let all: Vec<f64> = (0..=8000).map(|step| f64::from(step) / 1000.0).collect();
    let flows: Vec<f64> = (0..=8000).map(flow).collect();
    [("flow.csv", csv("time,flow", &[&all, &flows])), ("pressure.csv", csv("time,p", &[&times, &pressure]))]
}

/// The study for noise in mmHg with this `[estimator]` body.
pub fn study(noise: f64, estimator: &str) -> String {
    format!(
        r#"
[study]
name = "rcr"
[model]
kind = "windkessel-3"
[[parameters]]
name = "Zc"
prior = {{ transform = "log", median = 300.0, sd = 0.7 }}
[[parameters]]
name = "R"
prior = {{ transform = "log", median = 1200.0, sd = 0.7 }}
[[parameters]]
name = "C"
prior = {{ transform = "log", median = 2e-3, sd = 0.7 }}
[[parameters]]
name = "initial:p"
prior = {{ transform = "linear", median = 79993.2, sd = 39996.6 }}
[[records]]
name = "ten-beats"
file = "pressure.csv"
inputs = {{ flow = "flow.csv:flow" }}
channels = [ {{ column = "p", output = "pressure", noise = {} }} ]
[estimator]
{estimator}
"#,
        noise * MM_HG
    )
}
