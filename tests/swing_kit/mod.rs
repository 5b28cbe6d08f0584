//! A free oscillator whose start alone is unknown, seen by its position for three seconds of which two are fitted: its study, its motion in
//! closed form, and its recording.

#![allow(dead_code)] // every test file uses its own part

use std::fmt::Write;
use std::path::Path;

use nalgebra::Matrix2;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Mass 1, damping 0.4 and stiffness 9.
pub(crate) const STUDY: &str = r#"
[study]
name = "free"
seed = 5

[model]
kind = "oscillator"
constants = { m = 1.0, c = 0.4, k = 9.0 }

[[parameters]]
name = "initial:x"
unit = "m"
prior = { transform = "linear", median = 0.5, sd = 1.0 }

[[parameters]]
name = "initial:v"
unit = "m/s"
prior = { transform = "linear", median = 0.0, sd = 3.0 }

[[records]]
name = "swing"
file = "swing.csv"
time = "time"
channels = [ { column = "position", output = "position", noise = 0.2 } ]
train = [0.0, 2.0]

[estimator]
kind = "batch"
"#;

/// The noise that the study states.
pub(crate) const NOISE: f64 = 0.2;

/// Columns: position and velocity after a time from unit displacement (Meirovitch 1986, section 1.6), then from unit velocity.
pub(crate) fn motion(t: f64) -> Matrix2<f64> {
    let (sigma, w) = (0.2, (9.0_f64 - 0.04).sqrt());
    let (sin, cos) = (w * t).sin_cos();
    Matrix2::new(cos + sigma / w * sin, sin / w, -9.0 / w * sin, cos - sigma / w * sin) * (-sigma * t).exp()
}

/// Times and positions of the recording: a swing from unit displacement with errors that look like noise.
pub(crate) fn recording() -> Vec<(f64, f64)> {
    let error = |i: u32| NOISE * (f64::from(i * i) * 0.7).sin() * 1.4;
    (0..=30).map(|i| (0.1 * f64::from(i), motion(0.1 * f64::from(i))[(0, 0)] + error(i))).collect()
}

/// Writes `swing.csv` into a folder.
pub(crate) fn write(folder: &Path) {
    let mut csv = "time,position\n".to_owned();
    for (t, y) in recording() {
        writeln!(csv, "{t},{y}").unwrap();
    }
    std::fs::write(folder.join("swing.csv"), csv).unwrap();
}

/// Errors of a recording in units of their sd: white, or an autoregression, from a seed.
pub(crate) fn errors(seed: u64, correlation: f64, n: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut last: f64 = StandardNormal.sample(&mut rng);
    let mut next = || {
        let now = last;
        let z: f64 = StandardNormal.sample(&mut rng);
        last = correlation.mul_add(last, (1.0 - correlation * correlation).sqrt() * z);
        now
    };
    (0..n).map(|_| next()).collect()
}
