//! The filter against the dense covariance that it stands for.

use nalgebra::{DMatrix, DVector};

use super::working::filter::{Filtered, Form, deviance};
use super::{Influence, Residuals, Series};

/// Uneven times and two smooth columns with a prior of their own.
fn series(n: usize) -> Series {
    let time: Vec<f64> = (0..n).map(|k| k as f64 + 0.3 * (k as f64).sin()).collect();
    let jacobian =
        DMatrix::from_fn(n, 2, |k, j| if j == 0 { 3.0 } else { (0.4 * time[k]).sin() + 0.01 * time[k] });
    let influence = Influence::new(&jacobian).expect("finite");
    let residual = (0..n).map(|k| (1.7 * k as f64).sin() + 0.5 * (0.2 * k as f64).cos()).collect();
    Series { step: (0..n).collect(), time, residual, basis: influence.basis, influence: influence.rows }
}

/// Covariance of errors of variance one.
fn dense(series: &Series, form: &Form) -> DMatrix<f64> {
    let n = series.time.len();
    DMatrix::from_fn(n, n, |i, j| {
        let slow = (1.0 - form.white) * (-(series.time[i] - series.time[j]).abs() / form.time).exp();
        if i == j { 1.0 } else { slow }
    })
}

#[test]
fn what_the_innovations_move_the_estimate_by_is_what_the_errors_do() {
    let series = series(40);
    for (time, white) in [(0.7, 0.2), (6.0, 0.05), (300.0, 1e-4), (1.0, 1.0)] {
        let form = Form { time, white };
        let filtered = Filtered::new(&series, &form);
        let direct = series.influence.tr_mul(&(dense(&series, &form) * &series.influence));
        let moved: DVector<f64> =
            filtered.innovation.iter().zip(&filtered.influence).map(|(v, s)| s * *v).sum();
        let expected = series.influence.tr_mul(&DVector::from_vec(series.residual.clone()));
        for j in 0..2 {
            // Rounding of forty steps, of terms far larger than their sum where the correlation is long.
            assert!((filtered.variance()[j] / direct[(j, j)] - 1.0).abs() < 1e-9, "{time} {white}");
            assert!((moved[j] - expected[j]).abs() < 1e-10 * series.influence.column(j).norm(), "{time}");
        }
    }
}

#[test]
fn the_restricted_likelihood_is_that_of_the_dense_covariance() {
    let series = series(25);
    let r = DVector::from_vec(series.residual.clone());
    let q = &series.basis;
    for (time, white) in [(0.7, 0.2), (6.0, 0.05), (1.0, 1.0)] {
        let form = Form { time, white };
        let root = dense(&series, &form).cholesky().expect("definite");
        let log_det = 2.0 * root.l_dirty().diagonal().iter().map(|v| v.ln()).sum::<f64>();
        let inverse = root.inverse();
        let hessian = q.tr_mul(&(&inverse * q)) + DMatrix::identity(2, 2) - q.tr_mul(q);
        let pull = q.tr_mul(&(&inverse * &r));
        let squares =
            r.dot(&(&inverse * &r)) - pull.dot(&hessian.clone().lu().solve(&pull).expect("definite"));
        let left = 25.0 - q.norm_squared();
        let expected = left * squares.ln() + log_det + hessian.determinant().ln();
        let (found, size) = deviance(&series, &form);
        assert!((found - expected).abs() < 1e-9 && (size - squares / left).abs() < 1e-10, "{time} {white}");
    }
}

#[test]
fn the_influence_is_the_sandwichs_bread() {
    let jacobian = DMatrix::from_fn(12, 2, |k, j| ((k * (j + 2)) as f64).cos() + j as f64);
    let influence = Influence::new(&jacobian).expect("finite");
    let inverse = (DMatrix::identity(2, 2) + jacobian.tr_mul(&jacobian)).try_inverse().expect("definite");
    let expected = &jacobian * &inverse;
    assert!((&influence.rows - &expected).amax() < 1e-13);
    for j in 0..2 {
        assert!((influence.variance[j] - inverse[(j, j)]).abs() < 1e-14);
        // The prior's part and the data's part add up to H^-1.
        let of_data = influence.rows.column(j).norm_squared();
        assert!((influence.of_prior[j] + of_data - influence.variance[j]).abs() < 1e-14);
    }
    assert!(Residuals { jacobian: &jacobian, values: &DVector::zeros(11), places: &[] }.inflation().is_err());
}
