//! The routes through an analysis agree: few rows or many, diagonal or dense noise, Gram matrix or stored columns.
#![allow(clippy::unwrap_used)]
mod common;

use common::{difference, filter, gauss, normal, rng, uniform};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::{
    Analysis, Data, EstimatorError, Filter, Gaussian, Noise, Points, Root, recombine,
};

/// 700 rows in two blocks, a quarter missing, the first rows complete.
fn problem(points: Points, scale: f64) -> (Analysis, Analysis, Analysis) {
    let (p, m) = (4, 700);
    let mut g = rng(20);
    let roukf = filter(points, p, Root::Symmetric);
    let particles = roukf.init(&Gaussian::independent(&vec![0.0; p], &vec![1.0; p]));
    let slope = normal(&mut g, m, p) * scale;
    let u = &slope * &particles.theta;
    let z = u.map(|v| v + 0.2 * (v / scale.max(1.0)).powi(2));
    let mut values: Vec<f64> = (0..m).map(|k| z[(k, 1)] + gauss(&mut g)).collect();
    for v in values.iter_mut().step_by(4).skip(100) {
        *v = f64::NAN;
    }
    let sd: Vec<f64> = (0..m).map(|_| uniform(&mut g, 0.5, 2.0)).collect();
    let dense = DMatrix::from_diagonal(&DVector::from_iterator(m, sd.iter().map(|s| s * s)));
    let run = |noise: &Noise| roukf.analysis(&particles, &z, &Data { values: &values, noise }).unwrap().1;
    let (diagonal, full) = (run(&Noise::Diagonal(sd.clone())), run(&Noise::Dense(dense)));
    // Row by row with transformed predictions: the route of few rows, exact for the simplex.
    let (mut zs, mut t, mut log_likelihood) = (z.clone(), DMatrix::identity(z.ncols(), z.ncols()), 0.0);
    for first in (0..m).step_by(10) {
        let block = zs.rows(first, 10).clone_owned();
        let noise = Noise::Diagonal(sd[first..first + 10].to_vec());
        let a =
            roukf.analysis(&particles, &block, &Data { values: &values[first..first + 10], noise: &noise });
        let a = a.unwrap().1;
        zs *= &a.transform;
        t *= &a.transform;
        log_likelihood += a.log_likelihood;
    }
    let few = Analysis { transform: t, log_likelihood, ..diagonal.clone() };
    (diagonal, full, few)
}

fn agree(a: &Analysis, b: &Analysis, tolerance: f64) {
    assert!(difference(&a.transform, &b.transform) < tolerance, "{}", difference(&a.transform, &b.transform));
    assert!((a.log_likelihood / b.log_likelihood - 1.0).abs() < tolerance);
}

#[test]
fn diagonal_and_dense_noise_agree_over_many_rows_for_every_set() {
    for points in common::ALL {
        let (diagonal, dense, _) = problem(points, 1.0);
        // Sums over 500 rows in another order.
        agree(&diagonal, &dense, 1e-11);
        let same = |a: &DVector<f64>, b: &DVector<f64>| {
            a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12 || (a.is_nan() && b.is_nan()))
        };
        assert!(same(&diagonal.innovation, &dense.innovation));
        assert!(same(&diagonal.innovation_sd, &dense.innovation_sd));
        assert!((diagonal.nis / dense.nis - 1.0).abs() < 1e-11);
    }
}

#[test]
fn many_rows_at_once_or_ten_at_a_time_agree_for_the_simplex() {
    let (all, _, few) = problem(Points::Simplex, 1.0);
    let mean = |a: &Analysis| a.transform.column_mean();
    // The symmetric roots of a product differ by a rotation, so means and likelihoods are compared.
    assert!((mean(&all) - mean(&few)).amax() < 1e-10);
    assert!((all.log_likelihood / few.log_likelihood - 1.0).abs() < 1e-11);
}

#[test]
fn very_informative_rows_take_the_stable_route_without_losing_the_likelihood() {
    for points in [Points::Simplex, Points::Star] {
        let (p, m) = (3, 200);
        let mut g = rng(21);
        let roukf = filter(points, p, Root::Symmetric);
        let prior = Gaussian::independent(&[1.0, -1.0, 0.5], &[1.0; 3]);
        let particles = roukf.init(&prior);
        // One direction is seen 1e8 times more sharply than another: |S|^2 reaches 1e18.
        let mut h = normal(&mut g, m, p);
        h.column_mut(0).scale_mut(1e8);
        h.column_mut(2).scale_mut(1e-3);
        let z = &h * &particles.theta;
        let values: Vec<f64> = (&h * DVector::from_column_slice(&[1.0, -0.5, 0.4])).iter().copied().collect();
        let noise = Noise::Diagonal(vec![1.0; m]);
        let (after, a) = roukf.analysis(&particles, &z, &Data { values: &values, noise: &noise }).unwrap();
        // Closed form in scaled parameters, where the normal matrix is well conditioned.
        let scale = DMatrix::from_diagonal(&DVector::from_column_slice(&[1e-8, 1.0, 1e3]));
        let hs = &h * &scale;
        let prior_information = &scale * &scale;
        let u = hs.tr_mul(&hs) + prior_information;
        let d = DVector::from_column_slice(&values) - &h * &prior.mean;
        let shift = &scale * u.cholesky().unwrap().solve(&hs.tr_mul(&d));
        let found = roukf.gaussian(&after);
        let sd = found.sd();
        for j in 0..3 {
            // Predictions of 1e8 carry rounding of 1e-8, seen through 200 rows of unit noise.
            assert!(
                (found.mean[j] - prior.mean[j] - shift[j]).abs() < 1e-6 * sd[j].max(1e-9),
                "{points:?} {j}"
            );
        }
        assert!(a.nis < 1.0 && sd[0] < 1e-8 && sd[2] > 0.99, "{points:?} {} {sd}", a.nis);
    }
}

#[test]
fn recombination_equals_the_matrix_product_and_ignores_a_dropped_column() {
    let mut g = rng(22);
    let (x, mut t) = (normal(&mut g, 10_001, 7), normal(&mut g, 7, 7));
    let mut out = x.clone();
    recombine(&mut out, &t);
    assert!(difference(&out, &(&x * &t)) < 1e-13, "sums of seven products");
    t.row_mut(3).fill(0.0);
    let expected = &x * &t;
    let mut lost = x.clone();
    lost.column_mut(3).fill(f64::NAN);
    recombine(&mut lost, &t);
    assert!(difference(&lost, &expected) < 1e-13, "sums of seven products");
}

#[test]
fn recombination_is_the_matrix_product_for_any_number_of_particles_and_rows() {
    let mut g = rng(23);
    for r in [1, 2, 6, 10, 11, 13, 22, 23, 45] {
        for n in [1, 15, 16, 4097, 9000] {
            let (x, t) = (normal(&mut g, n, r), normal(&mut g, r, r));
            let mut out = x.clone();
            recombine(&mut out, &t);
            assert!(difference(&out, &(&x * &t)) < 1e-12, "sums of {r} products, {n} rows");
        }
    }
}

#[test]
fn a_noise_covariance_that_is_not_symmetric_is_refused_and_a_missing_row_is_not_looked_at() {
    let roukf = filter(Points::Simplex, 1, Root::Symmetric);
    let particles = roukf.init(&Gaussian::independent(&[0.0], &[1.0]));
    let z = DMatrix::from_fn(3, 2, |i, j| (i + j) as f64);
    let noise = Noise::Dense(DMatrix::from_row_slice(3, 3, &[2.0, 0.0, 0.5, 0.0, 2.0, 0.0, 0.4, 0.0, 2.0]));
    let run = |values: &[f64]| roukf.analysis(&particles, &z, &Data { values, noise: &noise });
    let refused = run(&[0.0; 3]).unwrap_err();
    assert_eq!(refused, EstimatorError::NoiseNotSymmetric { row: 0, column: 2, above: 0.5, below: 0.4 });
    assert_eq!(run(&[0.0, 1.0, f64::NAN]).unwrap().1.n_used, 2);
}

#[test]
fn predictions_whose_sensitivity_overflows_are_an_error() {
    for points in common::ALL {
        let roukf = filter(points, 2, Root::Symmetric);
        let particles = roukf.init(&Gaussian::independent(&[0.0; 2], &[1.0; 2]));
        let z = DMatrix::from_fn(
            2,
            particles.theta.ncols(),
            |i, j| if (i + j) % 2 == 0 { 1e308 } else { -1e308 },
        );
        let noise = Noise::Diagonal(vec![1e-3; 2]);
        let done = roukf.analysis(&particles, &z, &Data { values: &[0.0, 1.0], noise: &noise });
        assert!(matches!(done, Err(EstimatorError::NotFinite { .. })), "{points:?}");
    }
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let (a, ..) = problem(Points::Star, 1.0);
    let (b, ..) = problem(Points::Star, 1.0);
    assert_eq!(a.transform, b.transform);
    assert_eq!(a.log_likelihood.to_bits(), b.log_likelihood.to_bits());
}
