//! Dynamical inference on one core: points per second of the 27-coefficient reconstruction of the Lorenz system, against the
//! products alone; microseconds per sample of a detector that follows a recording of as many terms as the three tanks have, and the
//! three tanks themselves.
//!
//! `cargo bench -p starlings-estimators --bench inference`
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::disallowed_methods, clippy::disallowed_types)]

#[path = "../tests/inference/kit/mod.rs"]
#[allow(missing_docs, unreachable_pub)]
mod kit;

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use nalgebra::DMatrix;
use starlings_estimators::inference::{
    Basis, Detector, Diffusion, Fit, Following, Memory, Polynomial, Rule, Stream, Structure,
};

const NAMES: [&str; 3] = ["x1", "x2", "x3"];
const STEP: f64 = 0.005;

fn main() {
    let rows = lorenz(1_000_000);
    let times: Vec<f64> = (0..rows.len()).map(|n| n as f64 * STEP).collect();
    let quadratic = Polynomial::new(&NAMES, 3, &[0, 1, 2], 2, false);
    let basis = Arc::new(Basis::new(3, 0).with(Rule::MidPoint, quadratic).unwrap());
    let seconds = best(5, || {
        let mut stream = Stream::new(Arc::clone(&basis), STEP).unwrap();
        stream.extend(&times, rows.as_flattened()).unwrap();
        black_box(stream.take().unwrap());
    });
    let points = rows.len() as f64;
    println!("sums of 9 functions and 3 equations: {:.1} million points/s", points / seconds / 1e6);
    // Half of the products at lag zero and all at lag one, of 9 + 3 columns.
    let flops = points * 2.0 * (12.0 * 13.0 / 2.0 + 12.0 * 12.0);
    println!("  of their products: {:.2} Gflop/s", flops / seconds / 1e9);
    println!("  general matrix products of the same columns: {:.2} Gflop/s", products() / 1e9);
    let mut stream = Stream::new(Arc::clone(&basis), STEP).unwrap();
    stream.extend(&times, rows.as_flattened()).unwrap();
    let (sums, structure) = (stream.take().unwrap(), Structure::same(&basis, &NAMES).unwrap());
    let fit = Fit::new(Diffusion::Full, 27);
    let seconds = best(20, || drop(black_box(fit.posterior(&sums, &structure).unwrap())));
    println!("posterior of 27 coefficients and D: {:.0} microseconds", 1e6 * seconds);
    for (block, longer, and) in
        [(1, false, ""), (5, false, ""), (25, false, ""), (25, true, " and longer stretches")]
    {
        let seconds = best(3, || follow(&basis, (block, longer), &times[..50_000], &rows[..50_000]));
        println!(
            "detector, an answer every {block} samples{and}: {:.2} microseconds/sample",
            1e6 * seconds / 5e4
        );
    }
    let rows = kit::tanks::recording(1);
    let times = kit::times(rows.len(), 0.002);
    let seconds = best(10, || tanks(&times, &rows));
    let each = 1e6 * seconds / rows.len() as f64;
    println!("three tanks, an estimate and a test every sample: {each:.2} microseconds/sample");
}

/// All nine coefficients of the three tanks followed from sample to sample; leaks and couplings have no information before they open.
fn tanks(times: &[f64], rows: &[[f64; 3]]) {
    let basis = kit::tanks::basis();
    let following = Following {
        block: 1,
        recent: 4,
        reference: Memory::Growing,
        least: 1500,
        longer: false,
        rate: 1e-6,
        watched: vec![],
    };
    let fit = Fit::new(Diffusion::Diagonal, 9);
    let structure = kit::tanks::joint(&basis);
    let mut detector = Detector::new(basis, 0.002, structure, fit, following).unwrap();
    for (time, row) in times.iter().zip(rows) {
        black_box(detector.push(*time, row).unwrap());
    }
}

/// A detector with nine coefficients of nine functions, two of them shared.
fn follow(basis: &Arc<Basis>, (block, longer): (u64, bool), times: &[f64], rows: &[[f64; 3]]) {
    let structure = Structure::new(basis, &NAMES)
        .and_then(|s| s.with("sigma", &[("x1", "x2", 1.0), ("x1", "x1", -1.0)]))
        .and_then(|s| s.with("r", &[("x2", "x1", 1.0)]))
        .and_then(|s| s.with("a22", &[("x2", "x2", -1.0)]))
        .and_then(|s| s.with("b", &[("x2", "x1*x3", -1.0), ("x3", "x1*x2", 1.0)]))
        .and_then(|s| s.with("a33", &[("x3", "x3", -1.0)]))
        .and_then(|s| s.with("q1", &[("x1", "x1^2", 1.0)]))
        .and_then(|s| s.with("q2", &[("x2", "x2^2", 1.0)]))
        .and_then(|s| s.with("q3", &[("x3", "x3^2", 1.0)]))
        .and_then(|s| s.with("q4", &[("x3", "x2*x3", 1.0)]));
    let following = Following {
        block,
        recent: 4,
        reference: Memory::Growing,
        least: 500,
        longer,
        rate: 1e-6,
        watched: vec![],
    };
    let fit = Fit::new(Diffusion::Diagonal, 9);
    let mut detector = Detector::new(Arc::clone(basis), STEP, structure.unwrap(), fit, following).unwrap();
    for (time, row) in times.iter().zip(rows) {
        black_box(detector.push(*time, row).unwrap());
    }
}

/// Flops per second of AᵀA and AᵀB for blocks of 256 x 12, by nalgebra.
fn products() -> f64 {
    let a = DMatrix::from_fn(256, 12, |i, j| ((i * 31 + j * 17) % 101) as f64 / 101.0);
    let t = a.transpose();
    let mut sum = DMatrix::<f64>::zeros(12, 12);
    let seconds = best(5, || {
        for _ in 0..1000 {
            sum.gemm(1.0, black_box(&t), black_box(&a), 1.0);
        }
    });
    black_box(sum);
    1000.0 * 2.0 * 256.0 * 144.0 / seconds
}

/// Shortest of `n` timings, in seconds.
fn best(n: usize, mut work: impl FnMut()) -> f64 {
    let mut once = || {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..n).map(|_| once()).fold(f64::INFINITY, f64::min)
}

/// The Lorenz system under kicks of a multiplicative generator, by Euler's rule: only the numbers' size matters here.
fn lorenz(n: usize) -> Vec<[f64; 3]> {
    let mut state = 1_u64;
    let mut kick = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.1 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
    };
    let mut x = [1.0_f64, 1.0, 25.0];
    (0..=n)
        .map(|_| {
            let [a, b, c] = x;
            let d = [10.0 * (b - a), 28.0 * a - b - a * c, a * b - 8.0 / 3.0 * c];
            x = std::array::from_fn(|i| x[i] + STEP * d[i] + kick());
            x
        })
        .collect()
}
