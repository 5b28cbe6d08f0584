//! The tube under observers with its true parameters: which of them forgets a wrong filling, and what noise they let in.
#![allow(clippy::unwrap_used)]

mod fsi_tube_kit;

use fsi_tube_kit::{advance, inflow, periodic, tube, values};
use nalgebra::DMatrix;
use starlings_haemodynamics::FsiTube;
use starlings_models_core::observer::{self, Correction, Observer, Wiring};
use starlings_models_core::spectrum::{linearisation, natural, poles};
use starlings_models_core::{Model, NativeModels, ObserverDef};

const N: usize = 25;
/// Time between images in s, in steps of 1 ms.
const EVERY: u32 = 10;

fn observed(model: &FsiTube, theta: &[f64], kind: &str, gain: f64) -> Box<dyn Observer> {
    let outputs = ["displacement", "velocity"].map(str::to_owned);
    let wiring = Wiring { spec: model.spec(), outputs: &outputs, model, theta, native: NativeModels::NONE };
    observer::build(&ObserverDef { kind: kind.to_owned(), gain, ..ObserverDef::default() }, wiring).unwrap()
}

#[test]
fn the_filling_is_forgotten_under_displacement_feedback_alone() {
    let model = tube(N, 1e-3);
    let theta = values(&model, &[]);
    let a = linearisation(&model, &theta).unwrap();
    for (kind, gain, expected) in [
        ("none", 0.0, -0.460_314),
        ("dvf", 50.0, -0.460_314),
        ("dvf-am", 50.0, -0.459_793),
        ("sdf", 5.0, -1.139_195),
        ("sdf", 20.0, -2.560_593),
        ("sdf", 50.0, -4.050_544),
    ] {
        let feedback = observed(&model, &theta, kind, gain).feedback(&model, &theta);
        let found = poles(&natural(&model, &theta, &(&a - feedback))).unwrap();
        let slowest = found.iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max);
        // Of dense matrices written out elsewhere.
        assert!((slowest - expected).abs() < 1e-5, "{kind} at {gain}: {slowest}");
    }
}

/// Numbers of unit variance: sums of twelve uniform ones (splitmix64).
struct Draws(u64);

impl Draws {
    fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// One image to the next without inflow, as a matrix: the step is linear.
fn between_images(model: &FsiTube, theta: &[f64]) -> DMatrix<f64> {
    let n = model.spec().n_state();
    let mut unit = DMatrix::identity(n, n);
    for mut column in unit.column_iter_mut() {
        (0..EVERY).for_each(|_| advance(model, theta, [0.0; 2], 1e-3, column.as_mut_slice()));
    }
    unit
}

/// Root mean square error of the wall after corrections by noisy images, counted in their noise, when nothing of the start is left.
fn settled(model: &FsiTube, theta: &[f64], gain: f64) -> f64 {
    let n = model.spec().n_state();
    let pull = 1.0 - (-gain * 1e-3 * f64::from(EVERY)).exp();
    let mut seen = DMatrix::zeros(n, n);
    (0..N).for_each(|i| seen[(i, i)] = 1.0);
    // e⁺ = (1 − k H) Φ e + k H ξ; the covariance by doubling its sum.
    let mut step = (DMatrix::identity(n, n) - &seen * pull) * between_images(model, theta);
    let mut covariance = &seen * pull.powi(2);
    for _ in 0..16 {
        covariance += &step * &covariance * step.transpose();
        step = &step * &step;
    }
    (covariance.diagonal().rows(0, N).sum() / N as f64).sqrt()
}

/// The same of a run of ten beats from the truth, over the last eight.
fn run(model: &FsiTube, theta: &[f64], gain: f64) -> f64 {
    let noise = 0.011_879_706_5;
    let sdf = observed(model, theta, "sdf", gain);
    let mut draw = Draws(7);
    let mut truth = periodic(model, theta, 1e-3);
    let mut x = truth.clone();
    let (mut square, mut count) = (0.0, 0);
    for i in 0..8000_u32 {
        let q = [i, i + 1].map(|i| inflow(f64::from(i) * 1e-3));
        advance(model, theta, q, 1e-3, &mut truth);
        advance(model, theta, q, 1e-3, &mut x);
        if !(i + 1).is_multiple_of(EVERY) {
            continue;
        }
        let mut image = vec![f64::NAN; 2 * N];
        for (seen, eta) in image.iter_mut().zip(&truth[..N]) {
            *seen = eta + noise * draw.normal();
        }
        let (t, spans) = (f64::from(i + 1) * 1e-3, [1e-3 * f64::from(EVERY); 2 * N]);
        let predicted = x[..2 * N].to_vec();
        let at = Correction { t, spans: &spans, observed: &image, predicted: &predicted, model, theta };
        sdf.correct(at, &mut x);
        if i > 1600 {
            square += x[..N].iter().zip(&truth).map(|(a, b)| ((a - b) / noise).powi(2)).sum::<f64>();
            count += N;
        }
    }
    (square / count as f64).sqrt()
}

#[test]
fn noise_enters_with_the_gain() {
    let model = tube(N, 1e-3);
    let theta = values(&model, &[]);
    for (gain, expected) in [(5.0, 0.052_799), (20.0, 0.189_445), (50.0, 0.401_235)] {
        let floor = settled(&model, &theta, gain);
        // Of a discrete Lyapunov equation solved elsewhere.
        assert!((floor - expected).abs() < 1e-4, "{gain}: {floor}");
        // 640 images, of which those within a fifth of a second at the lowest gain are alike.
        let found = run(&model, &theta, gain);
        assert!((found / floor - 1.0).abs() < 0.2, "{gain}: {found} against {floor}");
    }
}
