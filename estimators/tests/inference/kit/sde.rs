//! Integrators of ẋ = f(x, t) + S ξ with constant S (so that Itô and Stratonovich agree) in small fixed dimensions.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn gauss(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// sqrt(h) S z with S lower triangular.
fn kick<const L: usize>(rng: &mut ChaCha8Rng, root: &[[f64; L]; L], h: f64) -> [f64; L] {
    let z: [f64; L] = std::array::from_fn(|_| gauss(rng));
    let sqrt = h.sqrt();
    std::array::from_fn(|i| sqrt * root[i][..=i].iter().zip(&z).map(|(s, z)| s * z).sum::<f64>())
}

fn sum<const L: usize>(x: &[f64; L], terms: &[(f64, &[f64; L])]) -> [f64; L] {
    std::array::from_fn(|i| x[i] + terms.iter().map(|(factor, d)| factor * d[i]).sum::<f64>())
}

/// Heun's rule, second order in the drift.
pub fn heun<const L: usize>(
    rng: &mut ChaCha8Rng,
    (t, h): (f64, f64),
    x: &[f64; L],
    root: &[[f64; L]; L],
    drift: &impl Fn(f64, &[f64; L]) -> [f64; L],
) -> [f64; L] {
    let noise = kick(rng, root, h);
    let first = drift(t, x);
    let second = drift(t + h, &sum(x, &[(h, &first), (1.0, &noise)]));
    sum(x, &[(0.5 * h, &first), (0.5 * h, &second), (1.0, &noise)])
}

/// The classical rule of fourth order, with half of the noise at the middle.
pub fn rk4<const L: usize>(
    rng: &mut ChaCha8Rng,
    (t, h): (f64, f64),
    x: &[f64; L],
    root: &[[f64; L]; L],
    drift: &impl Fn(f64, &[f64; L]) -> [f64; L],
) -> [f64; L] {
    let noise = kick(rng, root, h);
    let a = drift(t, x);
    let b = drift(t + 0.5 * h, &sum(x, &[(0.5 * h, &a), (0.5, &noise)]));
    let c = drift(t + 0.5 * h, &sum(x, &[(0.5 * h, &b), (0.5, &noise)]));
    let d = drift(t + h, &sum(x, &[(h, &c), (1.0, &noise)]));
    sum(x, &[(h / 6.0, &a), (h / 3.0, &b), (h / 3.0, &c), (h / 6.0, &d), (1.0, &noise)])
}

/// Rows at times 0, h, 2h, ...: `n` steps of `substeps` each by `step`.
pub fn record<const L: usize>(
    n: usize,
    (h, substeps): (f64, usize),
    x0: [f64; L],
    mut step: impl FnMut(f64, f64, &[f64; L]) -> [f64; L],
) -> Vec<[f64; L]> {
    let small = h / substeps as f64;
    let mut x = x0;
    let mut rows = vec![x];
    for k in 0..n {
        for j in 0..substeps {
            x = step(k as f64 * h + j as f64 * small, small, &x);
        }
        rows.push(x);
    }
    rows
}
