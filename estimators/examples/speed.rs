//! Times of one analysis of many observations, and of the recombination of large states against a plain copy.
#![allow(clippy::print_stdout)]

use std::time::Instant;

use nalgebra::DMatrix;
use starlings_estimators::{Data, Gaussian, Noise, Points, Root, Roukf, SigmaSet, recombine};

/// Least time of several runs, in seconds.
fn best(n: usize, mut f: impl FnMut()) -> f64 {
    (0..n)
        .map(|_| {
            let start = Instant::now();
            f();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = 100_000;
    for p in [6, 21, 22] {
        let set = SigmaSet::new(Points::Simplex, p)?;
        let r = set.n_particle();
        let filter = Roukf { set, root: Root::Symmetric, drift: vec![] };
        let particles = filter.init(&Gaussian::independent(&vec![0.0; p], &vec![1.0; p]));
        let z = DMatrix::from_fn(m, r, |k, j| ((k * 31 + j * 17) as f64).sin());
        let values: Vec<f64> = (0..m).map(|k| (k as f64).cos()).collect();
        let noise = Noise::Diagonal(vec![0.5; m]);
        let data = Data { values: &values, noise: &noise };
        let mut sum = 0.0;
        let t = best(30, || sum += filter.analysis(&particles, &z, &data).map_or(0.0, |(_, a)| a.nis));
        println!("analysis p={p} r={r} m={m}: {:.2} ms (nis sum {sum:.3e})", 1e3 * t);
    }
    let (n, r) = (1_000_000, 22);
    let x = DMatrix::from_fn(n, r, |k, j| ((k + 7 * j) % 1000) as f64);
    let t = DMatrix::from_fn(r, r, |i, j| if i == j { 0.9 } else { 0.1 / (r - 1) as f64 });
    let mut out = DMatrix::zeros(n, r);
    let gb = 2.0 * (n * r * 8) as f64 / 1e9;
    let copy = best(25, || out.as_mut_slice().copy_from_slice(x.as_slice()));
    let whole = best(25, || x.mul_to(&t, &mut out));
    let blocked = best(25, || recombine(&x, &t, &mut out));
    println!(
        "copy {:.1} GB/s, mul_to {:.1} GB/s ({:.0} %), recombine {:.1} GB/s ({:.0} %)",
        gb / copy,
        gb / whole,
        100.0 * copy / whole,
        gb / blocked,
        100.0 * copy / blocked
    );
    Ok(())
}
