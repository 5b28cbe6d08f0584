//! The reference plate: a sandwich of 2 m x 2 m, struck in its centre by a burst of 10 kHz and watched by six sensors.
#![allow(dead_code, reason = "each test binary uses its part")]

use std::f64::consts::PI;

use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_structures::plate::{Arrangement, Geometry, Inspection, Material};

/// Half width of the patch in m.
pub(crate) const HALF_WIDTH: f64 = 0.025;

pub(crate) const SENSORS: [[f64; 2]; 6] =
    [[0.35, 0.50], [1.60, 0.42], [0.55, 1.55], [1.45, 1.70], [1.05, 0.30], [0.25, 1.10]];

pub(crate) fn material() -> Material {
    Material::sandwich([1e11, 0.003, 1580.0], [2e8, 0.03, 110.0], 60.0)
}

/// sin(ωt/N) sin(ωt) for t ≤ Nπ/ω: a half-sine window of 1.75 cycles.
pub(crate) fn burst(step: f64, samples: usize) -> Vec<f64> {
    let (omega, n) = (2.0 * PI * 1e4, 3.5);
    let value = |t: f64| if t <= n * PI / omega { (omega * t / n).sin() * (omega * t).sin() } else { 0.0 };
    (0..samples).map(|i| value(i as f64 * step)).collect()
}

/// The arrangement with so many modes each way and this sampling interval, 3 ms long.
pub(crate) fn inspection(modes: usize, step: f64) -> Inspection {
    let samples = (3e-3 / step).round() as usize;
    Inspection::new(Arrangement {
        geometry: Geometry { length: [2.0; 2], modes: [modes; 2] },
        material: material(),
        source: [1.0; 2],
        sensors: SENSORS.to_vec(),
        step,
        force: burst(step, samples),
    })
}

/// Standard deviation of each row about its mean.
pub(crate) fn row_sd(recording: &DMatrix<f64>) -> Vec<f64> {
    recording.row_iter().map(|row| row.variance().sqrt()).collect()
}

/// White noise of these standard deviations, row by row.
pub(crate) fn with_noise(recording: &DMatrix<f64>, sd: &[f64], generator: &mut ChaCha8Rng) -> DMatrix<f64> {
    let mut noisy = recording.clone();
    for (mut row, sd) in noisy.row_iter_mut().zip(sd) {
        for value in &mut row {
            let draw: f64 = StandardNormal.sample(generator);
            *value += sd * draw;
        }
    }
    noisy
}
