//! Block-angular matrices against the dense matrices that they stand for.

use super::*;
use crate::{End, LeastSquares, Need, Scaled};

/// Rows of a block, blocks.
const M: usize = 12;
const K: usize = 7;
/// Columns: shared ones first and last, an own one and for even blocks a second between them.
const P: usize = 2 + K + K.div_ceil(2) + 1;

/// The columns that block `k` holds.
fn columns(k: usize) -> Vec<usize> {
    let second = k.is_multiple_of(2).then_some(2 + K + k / 2);
    [0, 1, 2 + k].into_iter().chain(second).chain([P - 1]).collect()
}

/// Numbers between -1 and 1 without a pattern.
fn noise(i: usize, j: usize) -> f64 {
    (((i * 37 + j * 101 + 13) as f64 * 12.9898).sin() * 43758.5453).fract()
}

/// A matrix whose own columns differ from its first shared one, within the block, by a share `apart` of their length.
fn matrix(apart: f64) -> BlockAngular {
    let places = (0..K).map(|k| (k * M..(k + 1) * M, columns(k)));
    BlockAngular::from_fn(K * M, P, places, |i, j| {
        let shared = noise(i, 0);
        if (2..2 + K).contains(&j) { shared + apart * noise(i, j) } else { noise(i, j) }
    })
}

fn vector(n: usize, seed: usize) -> DVector<f64> {
    DVector::from_fn(n, |i, _| noise(i, 1000 + seed))
}

fn diagonal(size: f64) -> Diagonal {
    Diagonal { entries: vector(P, 1).map(|v| size * (1.5 + v)), right: vector(P, 2) * size }
}

/// The dense rows that [`BlockAngular::least_squares`] minimises, free columns alone, with their right-hand side as the last
/// column.
fn stacked(a: &DMatrix<f64>, free: &[usize], right: &DVector<f64>, diagonals: &[Diagonal]) -> DMatrix<f64> {
    let (m, n) = (a.nrows(), free.len());
    let mut rows = a.select_columns(free).resize(m + diagonals.len() * n, n + 1, 0.0);
    rows.view_mut((0, n), (m, 1)).copy_from(right);
    for (d, diagonal) in diagonals.iter().enumerate() {
        for (k, &j) in free.iter().enumerate() {
            rows[(m + d * n + k, k)] = diagonal.entries[j];
            rows[(m + d * n + k, n)] = diagonal.right[j];
        }
    }
    rows
}

/// The solution by reflections of the whole.
fn dense_least_squares(rows: DMatrix<f64>) -> DVector<f64> {
    let n = rows.ncols() - 1;
    let triangle = rows.qr().unpack_r();
    let right = triangle.view((0, n), (n, 1)).column(0).into_owned();
    triangle.view((0, 0), (n, n)).solve_upper_triangular(&right).expect("of full rank")
}

#[test]
fn products_and_parts_are_those_of_the_dense_matrix() {
    let a = matrix(0.5);
    let dense = a.to_dense();
    let (x, y) = (vector(P, 3), vector(K * M, 4));
    // Sums of a few dozen numbers below one in another order.
    assert!((a.times(&x) - &dense * &x).amax() < 1e-14);
    assert!((a.tr_times(&y) - dense.tr_mul(&y)).amax() < 1e-13);
    assert!((a.squares() - DVector::from_fn(P, |j, _| dense.column(j).norm_squared())).amax() < 1e-13);
    let some: Vec<usize> = (0..K * M).filter(|i| i % 5 != 1 && !(M..2 * M).contains(i)).collect();
    assert_eq!(a.select_rows(&some).to_dense(), dense.select_rows(&some));
    assert_eq!(a.select_rows(&some).blocks().len(), K - 1, "a block without rows is left out");
    assert!(a.n_entry() < K * M * 6 && a.dense().is_none() && !a.is_empty() && a.is_finite());
}

#[test]
fn columns_are_moved_scaled_and_added() {
    let a = matrix(0.5);
    // The first column goes away, one is new in the middle.
    let source = |j: usize| match j {
        0 => Some((1, 2.0)),
        1 => None,
        j => Some((j, -1.0)),
    };
    let mut mapped = a.map_columns(P, source);
    let new = vector(K * M, 5);
    mapped.set_column(1, &new);
    let mut wanted = -a.to_dense();
    wanted.set_column(0, &(a.to_dense().column(1) * 2.0));
    wanted.set_column(1, &new);
    assert_eq!(mapped.to_dense(), wanted);
}

#[test]
fn least_squares_are_those_of_reflections_of_the_whole() {
    let (a, right) = (matrix(0.5), vector(K * M, 6));
    for free in
        [(0..P).collect::<Vec<usize>>(), (0..P).filter(|j| j % 3 != 1).collect(), vec![], vec![4], vec![0]]
    {
        let diagonals = [diagonal(0.3), diagonal(1e-6)];
        let found = a.least_squares(&free, &right, &diagonals).expect("finite");
        let rows = stacked(&a.to_dense(), &free, &right, &diagonals);
        let wanted = if free.is_empty() { DVector::zeros(0) } else { dense_least_squares(rows) };
        assert!((found.select_rows(&free) - &wanted).amax() < 1e-13 * (1.0 + wanted.amax()), "{free:?}");
        assert!((0..P).filter(|j| !free.contains(j)).all(|j| found[j].abs() <= 0.0));
    }
}

#[test]
fn nearly_dependent_columns_keep_the_digits_that_reflections_keep() {
    // The squares of these columns would be dependent to rounding: their condition is about 1e9.
    let (a, truth) = (matrix(1e-9), vector(P, 7));
    let free: Vec<usize> = (0..P).collect();
    let right = a.times(&truth);
    let found = a.least_squares(&free, &right, &[]).expect("finite");
    let dense = dense_least_squares(stacked(&a.to_dense(), &free, &right, &[]));
    let miss = |x: &DVector<f64>| (x - &truth).amax();
    // Backward stable: condition times rounding is about 1e-6.
    assert!(miss(&found) < 1e-5 && miss(&dense) < 1e-5, "{:e} and {:e}", miss(&found), miss(&dense));
    assert!((a.times(&found) - &right).amax() < 1e-13, "the residual has no part of the condition");
}

#[test]
fn the_range_and_the_covariance_are_those_of_the_dense_matrix() {
    for (apart, size) in [(0.5, 1.0), (0.5, 1e-5), (1e-7, 1e-5), (0.0, 1e-3)] {
        let (a, d) = (matrix(apart), diagonal(size).entries);
        let range = Subspace::new(&a, &d).expect("the prior holds every direction");
        let mut rows = a.to_dense().resize_vertically(K * M + P, 0.0);
        rows.view_mut((K * M, 0), (P, P)).set_diagonal(&d);
        let v = vector(K * M + P, 8);
        let outside = range.outside(&v);
        let along = rows.tr_mul(&outside).amax();
        assert!(along < 1e-13, "nothing of it lies in the range: {along:e} at {apart:e}");
        let qr = rows.clone().qr();
        let wanted = &v - qr.q() * qr.q().tr_mul(&v);
        // Which directions a nearly dependent pair spans is known to its condition times rounding.
        let condition = 1.0 / apart.max(size);
        assert!((&outside - wanted).amax() < 1e-14 * (10.0 + condition), "at {apart:e}, {size:e}");
        let inverse = qr.unpack_r().solve_upper_triangular(&DMatrix::identity(P, P)).expect("of full rank");
        let wanted = &inverse * inverse.transpose();
        let apart = (range.covariance() - &wanted).amax() / wanted.amax();
        assert!(apart < 1e-14 * (10.0 + condition), "the covariance: {apart:e}");
    }
}

#[test]
fn a_direction_that_nothing_holds_is_an_error() {
    let mut a = matrix(0.5);
    a.set_column(4, &DVector::zeros(K * M));
    let error = Subspace::new(&a, &DVector::zeros(P)).expect_err("an own column of zeros");
    assert!(matches!(error, crate::EstimatorError::NotPositiveDefinite { .. }));
    let mut a = matrix(0.5);
    a.set_column(0, &DVector::zeros(K * M));
    assert!(Subspace::new(&a, &DVector::zeros(P)).is_err(), "a shared column of zeros");
    assert!(Subspace::new(&matrix(0.5), &DVector::zeros(P)).is_ok());
}

#[test]
fn one_block_has_the_bits_of_the_dense_matrix() {
    let dense = matrix(0.5).to_dense();
    let a = BlockAngular::from(dense.clone());
    let (right, diagonals) = (vector(K * M, 9), [diagonal(0.3), diagonal(1e-6)]);
    let free: Vec<usize> = (0..P).filter(|j| *j != 3).collect();
    let found = a.least_squares(&free, &right, &diagonals).expect("finite").select_rows(&free);
    assert_eq!(found, dense_least_squares(stacked(&dense, &free, &right, &diagonals)));
    let d = diagonal(1.0).entries;
    let range = Subspace::new(&a, &d).expect("positive definite");
    let mut rows = dense.clone().resize_vertically(K * M + P, 0.0);
    rows.view_mut((K * M, 0), (P, P)).set_diagonal(&d);
    let qr = rows.qr();
    let (q, v) = (qr.q(), vector(K * M + P, 10));
    assert_eq!(range.outside(&v), &v - &q * q.tr_mul(&v));
    let inverse = qr.unpack_r().solve_upper_triangular(&DMatrix::identity(P, P)).expect("of full rank");
    assert_eq!(*range.covariance(), &inverse * inverse.transpose());
    let (mut learned, step, surprise) = (a, vector(P, 11), vector(K * M, 12));
    learned.learn(&surprise, &step);
    assert_eq!(learned.to_dense(), dense + &surprise * step.transpose() / step.norm_squared());
}

#[test]
fn the_secant_holds_in_every_block_and_leaves_the_zeros() {
    let (a, surprise) = (matrix(0.5), vector(K * M, 13));
    let mut step = vector(P, 14);
    // The step leaves block 3 where it is.
    for j in columns(3) {
        step[j] = 0.0;
    }
    let mut learned = a.clone();
    learned.learn(&surprise, &step);
    let left = a.times(&step) + &surprise - learned.times(&step);
    let inside = |i: usize| (3 * M..4 * M).contains(&i);
    assert!((0..K * M).all(|i| inside(i) || left[i].abs() < 1e-14), "what was seen is foretold");
    assert_eq!(learned.blocks()[3], a.blocks()[3], "nothing was learned where nothing moved");
    let places = |of: &BlockAngular| of.blocks().iter().map(|b| b.columns.clone()).collect::<Vec<_>>();
    assert_eq!(places(&learned), places(&a));
}

#[test]
fn a_fit_in_blocks_ends_where_the_dense_fit_ends() {
    // Decays of one rate from K starts, all known exactly.
    let time = |i: usize| 0.3 * (i % M) as f64;
    let predicted =
        |z: &DVector<f64>| DVector::from_fn(K * M, |i, _| z[1 + i / M] * (-z[0] * time(i)).exp() / 0.01);
    let truth = DVector::from_fn(1 + K, |j, _| if j == 0 { 0.7 } else { 1.0 + 0.3 * j as f64 });
    let jacobian = |z: &DVector<f64>| {
        let places = (0..K).map(|k| (k * M..(k + 1) * M, vec![0, 1 + k]));
        BlockAngular::from_fn(K * M, 1 + K, places, |i, j| {
            let decay = (-z[0] * time(i)).exp() / 0.01;
            if j == 0 { -time(i) * z[1 + i / M] * decay } else { decay }
        })
    };
    let run = |of: &dyn Fn(BlockAngular) -> BlockAngular| {
        let bounds = vec![[f64::NEG_INFINITY, f64::INFINITY]; 1 + K];
        let none = DVector::zeros(1 + K);
        let prior = Scaled { mean: none.clone(), precision: none.clone(), bounds, growth: none };
        let mut fit = LeastSquares::new(DVector::from_element(1 + K, 1.0), prior, 1e-6, 50);
        let mut runs = 0;
        loop {
            runs += 1;
            match fit.need().clone() {
                Need::Residual(z) => fit.give_residual(Some(predicted(&truth) - predicted(&z))),
                Need::Jacobian(z) => fit.give_jacobian(Some(of(jacobian(&z)))),
                Need::Nothing(end) => return (end, fit.best().0.clone(), runs),
            }
        }
    };
    let (end, blocks, of_blocks) = run(&|jacobian| jacobian);
    let (_, dense, of_dense) = run(&|jacobian| jacobian.to_dense().into());
    assert_eq!(end, End::Converged);
    // A cost of 1e-6 at slopes of a hundred per unit is 1e-5.
    assert!((&blocks - &truth).amax() < 1e-4 && (dense - &truth).amax() < 1e-4, "{blocks}");
    assert!(of_blocks <= of_dense, "the secant in blocks needs no more: {of_blocks} against {of_dense}");
}
