//! The filter on a Windkessel: reference trajectory, the plain unscented filter, two passes.
#![allow(clippy::unwrap_used)]
mod common;

use common::rcr::{MM_HG, TRUTH, forecast, physical, predict, pressure, prior, truth};
use common::{filter, gauss, rng};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::{
    Data, Filter, Gaussian, Noise, Particles, Points, Resampled, Root, Roukf, SigmaSet, exchange_prior,
};

/// Filters all pressures; particles after each analysis and the log-likelihood.
fn run(roukf: &Roukf, prior: &Gaussian, observed: &[f64], sigma: f64) -> (Vec<Particles>, f64) {
    let mut particles = roukf.init(prior);
    let mut pi = particles.theta.rows(3, 1).clone_owned();
    let noise = Noise::Diagonal(vec![sigma]);
    let mut log_likelihood = 0.0;
    let mut out = Vec::with_capacity(observed.len());
    for (k, z) in observed.iter().enumerate() {
        if k > 0 {
            forecast(&mut pi, &particles.theta, k);
        }
        let data = Data { values: std::slice::from_ref(z), noise: &noise };
        let (next, a) = roukf.analysis(&particles, &predict(&pi, &particles.theta, k), &data).unwrap();
        pi *= &a.transform;
        log_likelihood += a.log_likelihood;
        particles = next;
        out.push(particles.clone());
    }
    (out, log_likelihood)
}

#[test]
fn noise_free_pressures_give_the_reference_estimate_after_1_3_and_10_beats() {
    let roukf = filter(Points::Simplex, 4, Root::Symmetric);
    let (particles, log_likelihood) = run(&roukf, &prior(0.7), &pressure(&truth()), 2.0 * MM_HG);
    let reference = [
        (79, [1.482_569_76e2, 1.970_790_77e3, 9.504_134_74e-4]),
        (239, [1.512_495_60e2, 1.855_235_79e3, 9.842_238_83e-4]),
        (800, [1.504_572_79e2, 1.850_104_88e3, 9.943_801_00e-4]),
    ];
    for (k, expected) in reference {
        for (value, expected) in physical(&roukf.mean(&particles[k])).into_iter().zip(expected) {
            // The reference is printed with nine digits.
            assert!((value / expected - 1.0).abs() < 1e-8, "analysis {k}: {value} {expected}");
        }
    }
    assert!((log_likelihood + 7_083.456_849).abs() < 1e-5);
    let sd = roukf.gaussian(&particles[800]).sd();
    for (sd, expected) in sd.iter().zip([0.005_822_9, 0.001_085_2, 0.007_880_5]) {
        assert!((sd - expected).abs() < 6e-8, "the reference is printed with seven decimals");
    }
}

#[test]
fn star_points_resampled_before_each_analysis_are_the_plain_unscented_filter() {
    let roukf = filter(Points::Star, 4, Root::Symmetric);
    let set = &roukf.set;
    let (noise, r) = (Noise::Diagonal(vec![2.0 * MM_HG]), set.n_particle());
    // Unequal scales: equal prior sd would leave the leading directions undefined.
    let norm = DVector::from_column_slice(&[1.0, 1.3, 0.8, 0.1 / MM_HG]);
    let mut particles = roukf.init(&prior(0.7));
    let mut pi = particles.theta.rows(3, 1).clone_owned();
    // The plain filter knows the augmented state (log R_p, log R_d, log C, pi) and its sigma points only.
    let mut plain = particles.theta.clone();
    for (k, &z) in pressure(&truth()).iter().enumerate().take(120) {
        if k > 0 {
            forecast(&mut pi, &particles.theta, k);
            let mut plain_pi = plain.rows(3, 1).clone_owned();
            forecast(&mut plain_pi, &plain, k);
            plain.rows_mut(3, 1).copy_from(&plain_pi);
        }
        let mut augmented = particles.theta.clone();
        augmented.rows_mut(3, 1).copy_from(&pi);
        let (mean, _) = common::moments(&augmented, set);
        let weighted =
            DMatrix::from_fn(4, r, |i, j| norm[i] * set.weights[j].sqrt() * (augmented[(i, j)] - mean[i]));
        let Resampled { particles: resampled, transform: t, dropped } =
            roukf.resample(&particles, &weighted.tr_mul(&weighted)).unwrap();
        // As many parameters as states: four directions hold everything, up to rounding.
        assert!(dropped < 1e-12, "{dropped}");
        pi *= &t;
        let data = Data { values: &[z], noise: &noise };
        let (next, a) = roukf.analysis(&resampled, &predict(&pi, &resampled.theta, k), &data).unwrap();
        pi *= &a.transform;
        particles = next;

        let (mean, covariance) = unscented_update(&mut plain, set, &norm, k, z);
        let mut augmented = particles.theta.clone();
        augmented.rows_mut(3, 1).copy_from(&pi);
        let (m, c) = common::moments(&augmented, set);
        for i in 0..4 {
            // 120 nonlinear steps amplify roundings of the eigenvectors.
            assert!((m[i] - mean[i]).abs() * norm[i] < 1e-8, "mean {i} at {k}");
            for j in 0..4 {
                assert!(
                    (c[(i, j)] - covariance[(i, j)]).abs() * norm[i] * norm[j] < 1e-8,
                    "covariance at {k}"
                );
            }
        }
    }
}

/// Textbook update with points redrawn from the forecast covariance: returns mean and covariance, redraws the points.
fn unscented_update(
    x: &mut DMatrix<f64>,
    set: &SigmaSet,
    norm: &DVector<f64>,
    k: usize,
    z: f64,
) -> (DVector<f64>, DMatrix<f64>) {
    let (mean, covariance) = common::moments(x, set);
    let scaled = DMatrix::from_diagonal(norm) * &covariance * DMatrix::from_diagonal(norm);
    let eigen = scaled.symmetric_eigen();
    let mut order = [0, 1, 2, 3];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let root = DMatrix::from_fn(4, 4, |i, j| {
        eigen.eigenvectors[(i, order[j])] * eigen.eigenvalues[order[j]].sqrt() / norm[i]
    });
    let points = common::around(&mean, &root, set);
    let h = DMatrix::from_fn(1, points.ncols(), |_, i| {
        points[(3, i)] + points[(0, i)].exp() * common::rcr::flow(10 * k)
    });
    let centre = (&h * &set.weights)[0];
    let (mut pzz, mut pxz) = ((2.0 * MM_HG).powi(2), DVector::zeros(4));
    for i in 0..points.ncols() {
        pzz += set.weights[i] * (h[i] - centre).powi(2);
        pxz += (points.column(i) - &mean) * (set.weights[i] * (h[i] - centre));
    }
    let after = &mean + &pxz * ((z - centre) / pzz);
    let covariance = covariance - &pxz * pxz.transpose() / pzz;
    let inverse = root.clone().try_inverse().unwrap();
    let eigen = (&inverse * &covariance * inverse.transpose()).symmetric_eigen();
    let c = &eigen.eigenvectors
        * DMatrix::from_diagonal(&eigen.eigenvalues.map(f64::sqrt))
        * eigen.eigenvectors.transpose();
    *x = common::around(&after, &(root * c), set);
    (after, covariance)
}

#[test]
fn two_passes_recover_the_windkessel_from_noisy_pressures() {
    let roukf = filter(Points::Simplex, 4, Root::Symmetric);
    let clean = pressure(&truth());
    let seeds = 8;
    let mut square = [0.0; 3];
    for seed in 0..seeds {
        let mut g = rng(100 + seed);
        let noisy: Vec<f64> = clean.iter().map(|p| p + 2.0 * MM_HG * gauss(&mut g)).collect();
        let (first, _) = run(&roukf, &prior(0.7), &noisy, 2.0 * MM_HG);
        let centre = roukf.mean(first.last().unwrap());
        let mut used = prior(0.1);
        used.mean.rows_mut(0, 3).copy_from(&centre.rows(0, 3));
        let (second, _) = run(&roukf, &used, &noisy, 2.0 * MM_HG);
        let posterior = roukf.gaussian(second.last().unwrap());
        let posterior = exchange_prior(&posterior, &used, &prior(0.7)).unwrap().posterior;
        for (s, (v, t)) in square.iter_mut().zip(physical(&posterior.mean).into_iter().zip(TRUTH)) {
            *s += (v / t - 1.0).powi(2) / seeds as f64;
        }
    }
    // Root mean square errors of a batch fit would be 0.6, 0.1, 0.8 %.
    for (s, bound) in square.into_iter().zip([0.015, 0.002, 0.02]) {
        assert!(s.sqrt() < bound, "{square:?}");
    }
}

#[test]
fn resampling_leaves_the_simplex_and_pulled_particles_alone() {
    let simplex = filter(Points::Simplex, 4, Root::Symmetric);
    let particles = simplex.init(&prior(0.7));
    let same = simplex.resample(&particles, &DMatrix::identity(5, 5)).unwrap();
    assert_eq!(same, Resampled { particles, transform: DMatrix::identity(5, 5), dropped: 0.0 });
    let star = filter(Points::Star, 4, Root::Symmetric);
    let (pulled, _) = star.pull(&star.init(&prior(0.7)), 2, 0.5);
    let same = star.resample(&pulled, &DMatrix::identity(9, 9)).unwrap();
    assert_eq!(same, Resampled { particles: pulled, transform: DMatrix::identity(9, 9), dropped: 0.0 });
}

#[test]
fn resampling_says_which_share_of_the_spread_it_dropped() {
    let star = filter(Points::Star, 4, Root::Symmetric);
    let particles = star.init(&prior(0.7));
    let gram =
        DMatrix::from_diagonal(&DVector::from_column_slice(&[8.0, 1.0, 0.0, 4.0, 2.0, 0.0, 4.0, 1.0, 0.0]));
    // 8 + 4 + 4 + 2 of 20 are kept.
    let dropped = star.resample(&particles, &gram).unwrap().dropped;
    assert!((dropped - 0.1).abs() < 1e-14, "{dropped}: a few roundings");
}
