//! Random matrices and textbook filters that the tests compare with. Every random number is from ChaCha8 with a seed.
#![allow(clippy::unwrap_used, dead_code, missing_docs, unreachable_pub)]

pub mod batch;
pub mod rcr;

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_estimators::{Noise, Points, Root, Roukf, SigmaSet};

pub const ALL: [Points; 4] =
    [Points::Simplex, Points::Canonical, Points::Star, Points::JulierUhlmann { kappa: 1.0 }];

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn gauss(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

pub fn normal(rng: &mut ChaCha8Rng, n: usize, m: usize) -> DMatrix<f64> {
    DMatrix::from_fn(n, m, |_, _| gauss(rng))
}

pub fn uniform(rng: &mut ChaCha8Rng, lo: f64, hi: f64) -> f64 {
    rand_distr::Uniform::new(lo, hi).unwrap().sample(rng)
}

pub fn filter(points: Points, p: usize, root: Root) -> Roukf {
    Roukf { set: SigmaSet::new(points, p).unwrap(), root }
}

/// centre 1^T + L I.
pub fn around(centre: &DVector<f64>, l: &DMatrix<f64>, set: &SigmaSet) -> DMatrix<f64> {
    let mut x = l * &set.points;
    for mut column in x.column_iter_mut() {
        column += centre;
    }
    x
}

/// Mean and normalised factor of particles.
pub fn mean_factor(x: &DMatrix<f64>, set: &SigmaSet) -> (DVector<f64>, DMatrix<f64>) {
    (x * &set.weights, x * DMatrix::from_diagonal(&set.weights) * set.points.transpose())
}

/// Weighted mean and covariance of particles, even part included.
pub fn moments(x: &DMatrix<f64>, set: &SigmaSet) -> (DVector<f64>, DMatrix<f64>) {
    let mean = x * &set.weights;
    let mut deviation = x.clone();
    for mut column in deviation.column_iter_mut() {
        column -= &mean;
    }
    let covariance = &deviation * DMatrix::from_diagonal(&set.weights) * deviation.transpose();
    (mean, covariance)
}

pub fn difference(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    (a - b).amax()
}

/// A linear Gaussian problem whose uncertainty lives in p parameters and their effect on the initial state.
pub struct Linear {
    pub p: usize,
    pub a: DMatrix<f64>,
    pub h: DMatrix<f64>,
    pub w: DMatrix<f64>,
    pub noise: Noise,
    pub x0: DVector<f64>,
    pub l0: DMatrix<f64>,
    pub observed: Vec<Vec<f64>>,
}

/// n = 30 states of which the last p = 5 are the parameters, m = 8, 60 steps, 30 % missing, dense noise.
pub fn linear(seed: u64) -> Linear {
    let (n, p, m, steps) = (30, 5, 8, 60);
    let mut g = rng(seed);
    let q = normal(&mut g, n, n).qr().q();
    let decay = DVector::from_fn(n, |_, _| uniform(&mut g, 0.9, 1.0));
    let mut a = &q * DMatrix::from_diagonal(&decay) * q.transpose();
    a.rows_mut(n - p, p).fill(0.0);
    a.view_mut((n - p, n - p), (p, p)).fill_with_identity();
    let h = normal(&mut g, m, n);
    let root = normal(&mut g, m, m);
    let w = &root * root.transpose() + DMatrix::identity(m, m);
    let mut l0 = normal(&mut g, n, p) * 0.1;
    l0.rows_mut(n - p, p).fill(0.0);
    for j in 0..p {
        l0[(n - p + j, j)] = uniform(&mut g, 0.5, 2.0);
    }
    let x0 = normal(&mut g, n, 1).column(0).clone_owned();
    let mut observed: Vec<Vec<f64>> = (0..steps)
        .map(|_| {
            (0..m)
                .map(|_| if uniform(&mut g, 0.0, 1.0) < 0.3 { f64::NAN } else { 2.0 * gauss(&mut g) })
                .collect()
        })
        .collect();
    observed[7] = vec![f64::NAN; m];
    let noise = Noise::Dense(w.clone());
    Linear { p, a, h, w, noise, x0, l0, observed }
}

/// Mean and covariance before and after each analysis.
pub struct Kalman {
    pub forecast: Vec<(DVector<f64>, DMatrix<f64>)>,
    pub analysis: Vec<(DVector<f64>, DMatrix<f64>)>,
    pub log_likelihood: f64,
}

/// The Kalman filter in covariance form (Kalman 1960).
pub fn kalman(problem: &Linear) -> Kalman {
    let (mut x, mut c) = (problem.x0.clone(), &problem.l0 * problem.l0.transpose());
    let mut run = Kalman { forecast: vec![], analysis: vec![], log_likelihood: 0.0 };
    for z in &problem.observed {
        x = &problem.a * x;
        c = &problem.a * c * problem.a.transpose();
        run.forecast.push((x.clone(), c.clone()));
        let rows: Vec<usize> = (0..z.len()).filter(|&k| !z[k].is_nan()).collect();
        if !rows.is_empty() {
            let h = problem.h.select_rows(&rows);
            let w = DMatrix::from_fn(rows.len(), rows.len(), |i, j| problem.w[(rows[i], rows[j])]);
            let d = DVector::from_iterator(rows.len(), rows.iter().map(|&k| z[k])) - &h * &x;
            let s = &h * &c * h.transpose() + w;
            let root = s.clone().cholesky().unwrap();
            let gain = root.solve(&(&h * &c)).transpose();
            let log_det = 2.0 * root.l().diagonal().map(f64::ln).sum();
            let m = rows.len() as f64;
            run.log_likelihood -= 0.5 * (m * std::f64::consts::TAU.ln() + log_det + d.dot(&root.solve(&d)));
            x += &gain * d;
            c -= &gain * s * gain.transpose();
        }
        run.analysis.push((x.clone(), c.clone()));
    }
    run
}
