//! Identifiability before the fit: the Windkessel's generalised sensitivities, and problems that have no unique answer.
#![allow(clippy::unwrap_used)]
mod common;

use common::rcr::{DT, EVERY, MM_HG, N_STEP, TRUTH, advance, flow, periodic, pressure, truth};
use nalgebra::DMatrix;
use proptest::prelude::*;
use starlings_estimators::{Points, Sensitivities, SigmaSet, sigma_point_sensitivities, weak_directions};

const NOISE: f64 = 2.0 * MM_HG;

/// Derivatives of the pressures by log R_p, log R_d, log C and pi(0), by differentiating the recursion.
fn windkessel() -> DMatrix<f64> {
    let [r_p, r_d, c] = TRUTH;
    let e = (-DT / (r_d * c)).exp();
    let e_by_log = e * DT / (r_d * c);
    let (mut pi, mut by_r_d, mut by_c, mut by_start) = (periodic(), 0.0, 0.0, 1.0);
    let mut rows = Vec::new();
    for k in 0..=N_STEP {
        if k % EVERY == 0 {
            rows.extend([r_p * flow(k), by_r_d, by_c, by_start]);
        }
        let driven = r_d * 0.5 * (flow(k) + flow(k + 1));
        let by_e = e_by_log * (pi - driven);
        by_r_d = e * by_r_d + by_e + (1.0 - e) * driven;
        by_c = e * by_c + by_e;
        by_start *= e;
        pi = advance(pi, r_d, c, k);
    }
    DMatrix::from_row_slice(rows.len() / 4, 4, &rows)
}

fn exact(whitened: &DMatrix<f64>, prior_sd: &[f64]) -> Sensitivities {
    Sensitivities::new(whitened, prior_sd, 1e-12).unwrap()
}

#[test]
fn generalised_sensitivities_of_the_windkessel_are_those_of_the_table() {
    let s = windkessel().columns(0, 3) / NOISE;
    let s = exact(&s.into_owned(), &[0.7; 3]);
    let step: Vec<usize> = (0..=N_STEP / EVERY).collect();
    let functions = s.generalised(&s.fisher().unwrap(), &step).unwrap();
    let table = [
        [0.0294, 0.1163, 0.1163, 0.3279, 1.0],
        [-0.0004, -0.0029, 0.0055, 0.0928, 1.0],
        [-0.0001, 0.0954, 0.1910, 0.4137, 1.0],
    ];
    for (function, expected) in functions.iter().zip(table) {
        let function = function.as_ref().unwrap();
        for (k, expected) in [10, 30, 80, 240, 800].into_iter().zip(expected) {
            // The table has four decimals.
            assert!((function[k] - expected).abs() < 6e-5, "{k}: {} {expected}", function[k]);
        }
    }
}

#[test]
fn data_and_prior_together_leave_the_sd_of_the_batch_fit() {
    let s = exact(&(windkessel() / NOISE), &[0.7, 0.7, 0.7, 30.0 * MM_HG]);
    let covariance = s.fisher().unwrap().posterior_covariance();
    for (j, expected) in [0.005_836_28, 0.001_044_43, 0.008_004_8].into_iter().enumerate() {
        // The reference was printed with six or seven digits, from differences with steps of 1e-5.
        assert!((covariance[(j, j)].sqrt() / expected - 1.0).abs() < 1e-5, "{j}");
    }
}

#[test]
fn sigma_points_give_the_derivatives_of_the_windkessel() {
    let (set, scale) = (SigmaSet::new(Points::Star, 4).unwrap(), 1e-3);
    let unit = [0.7, 0.7, 0.7, 30.0 * MM_HG];
    let columns: Vec<Vec<f64>> = set
        .points
        .column_iter()
        .map(|point| {
            let theta: Vec<f64> = (0..4).map(|j| truth()[j] + scale * unit[j] * point[j]).collect();
            pressure(&theta)
        })
        .collect();
    let predictions = DMatrix::from_fn(columns[0].len(), columns.len(), |i, j| columns[j][i]);
    let found = sigma_point_sensitivities(&set, &predictions, scale).unwrap();
    let exact = windkessel();
    for (j, unit) in unit.into_iter().enumerate() {
        let difference = (found.column(j) / unit - exact.column(j)).norm() / exact.column(j).norm();
        // Central differences: (1e-3 * 0.7 * sqrt(4.5))^2 / 6 = 4e-7 times the third derivative.
        assert!(difference < 1e-6, "{j}: {difference}");
    }
}

#[test]
fn generalised_sensitivities_take_the_rows_of_one_time_together_and_end_at_one() {
    let s = DMatrix::from_row_slice(5, 2, &[1.0, 0.0, 0.0, 2.0, f64::NAN, 1.0, 1.0, 1.0, 3.0, -1.0]);
    let s = exact(&s, &[1.0, 1.0]);
    assert_eq!(s.n_used(), 4, "the row with a NaN is left out");
    let functions = s.generalised(&s.fisher().unwrap(), &[0, 0, 1, 2, 2]).unwrap();
    let (a, b) = (functions[0].as_ref().unwrap(), functions[1].as_ref().unwrap());
    // F = [[11, -2], [-2, 6]], det 62; rows of time 0: (6, 2)/62 . (1, 0) and (4, 22)/62 . (0, 2).
    assert!((a[0] - 6.0 / 62.0).abs() < 1e-14 && (b[0] - 44.0 / 62.0).abs() < 1e-14, "{a:?} {b:?}");
    assert!((a[1] - a[0]).abs() < 1e-15, "a time whose only row is missing adds nothing");
    assert!((a[2] - 1.0).abs() < 1e-14 && (b[2] - 1.0).abs() < 1e-14);
}

#[test]
fn only_the_sum_of_two_parameters_is_known_and_no_figure_pretends_otherwise() {
    // The third parameter stands alone; the first two enter as a + b/2.
    let s = DMatrix::from_row_slice(3, 3, &[2.0, 1.0, 0.0, 0.0, 0.0, 5.0, 4.0, 2.0, 0.0]);
    let s = exact(&s, &[1.0, 2.0, 1.0]);
    let fisher = s.fisher().unwrap();
    assert_eq!(fisher.rank(), 2);
    let errors = fisher.standard_errors();
    assert_eq!((errors[0], errors[1]), (None, None));
    assert!((errors[2].unwrap() - 0.2).abs() < 1e-14);
    let correlation = fisher.correlation();
    assert!((correlation[(0, 1)].unwrap() + 1.0).abs() < 1e-12, "the limit of the correlation");
    assert_eq!(correlation[(0, 2)], None);
    let weakest = &fisher.directions()[0];
    // In prior sd the columns are equal, so the difference is what remains unknown.
    assert!((weakest.coefficients[0] * weakest.coefficients[1] + 1.0).abs() < 1e-12, "{weakest:?}");
    assert!((weakest.share - 1.0).abs() < 1e-12 && weakest.standard_error.is_none());
    let functions = s.generalised(&fisher, &[0, 1, 2]).unwrap();
    assert!(functions[0].is_none() && functions[1].is_none());
    assert!((functions[2].as_ref().unwrap()[2] - 1.0).abs() < 1e-14);
    assert_eq!(s.collinearity().subsets[0].index, None, "dependent columns have no finite index");
    // What the prior knows stays: half its variance along the difference, by symmetry.
    let covariance = fisher.posterior_covariance();
    assert!((covariance[(0, 0)] - 0.5 * (1.0 + 1.0 / 41.0)).abs() < 1e-12, "s^2 = 40 along the sum");
}

#[test]
fn columns_that_agree_to_their_accuracy_are_one_and_leave_the_third_parameter_alone() {
    let exactly = [[3.0, 3.0, 1.0], [1.0, 1.0, -2.0], [-2.0, -2.0, 0.5], [0.0, 0.0, 1.0]];
    let error = [2e-3, 1e-3, 3e-3, -2e-3];
    let s = DMatrix::from_fn(4, 3, |i, j| 1e4 * (exactly[i][j] + if j == 1 { error[i] } else { 0.0 }));
    let coarse = Sensitivities::new(&s, &[1.0; 3], 1e-2).unwrap().fisher().unwrap();
    assert_eq!(coarse.rank(), 2);
    let errors = coarse.standard_errors();
    assert!(errors[0].is_none() && errors[1].is_none() && errors[2].is_some(), "{errors:?}");
    // Were the columns exact, the small difference between them would be information: 40 noise sd per prior sd.
    let fine = Sensitivities::new(&s, &[1.0; 3], 1e-6).unwrap().fisher().unwrap();
    assert_eq!(fine.rank(), 3);
    assert!(fine.standard_errors()[0].unwrap() < 0.1);
}

#[test]
fn a_parameter_that_changes_nothing_keeps_its_prior_and_disturbs_no_other() {
    let s = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.5, 2.0, 0.0, -1.0, 0.0, 0.0, 1.0]);
    let s = exact(&s, &[1.0, 3.0, 1.0]);
    assert_eq!(s.silent(), [1]);
    let fisher = s.fisher().unwrap();
    assert_eq!(fisher.standard_errors()[1], None);
    assert!((fisher.posterior_covariance()[(1, 1)] - 9.0).abs() < 1e-12);
    let without = exact(&DMatrix::from_row_slice(3, 2, &[1.0, 0.5, 2.0, -1.0, 0.0, 1.0]), &[1.0, 1.0]);
    let expected = without.fisher().unwrap();
    assert!((fisher.standard_errors()[0].unwrap() - expected.standard_errors()[0].unwrap()).abs() < 1e-14);
    assert_eq!(fisher.correlation()[(0, 1)], None);
    let direction = &fisher.directions()[0];
    assert_eq!(direction.coefficients, [0.0, 1.0, 0.0]);
    assert_eq!(s.collinearity().all.parameters, [0, 2]);
}

#[test]
fn several_directions_without_information_are_told_apart_by_parameters_of_their_own() {
    // Observed: a + b + c. Unknown: everything else, among it d. Two more directions, each with its own parameter.
    let s = exact(&DMatrix::from_row_slice(1, 4, &[1.0, 1.0, 1.0, 0.0]), &[1.0; 4]);
    let directions = s.fisher().unwrap().directions();
    assert_eq!(directions.len(), 4);
    for direction in &directions[..3] {
        let terms = direction.coefficients.iter().filter(|c| c.abs() > 1e-9).count();
        assert!(terms <= 2, "{direction:?}");
        let sum: f64 = direction.coefficients[..3].iter().sum();
        assert!(sum.abs() < 1e-12, "no part along the sum that is known");
    }
    assert!((directions[3].share - 0.5).abs() < 1e-12, "1/sqrt(1 + 3)");
}

#[test]
fn no_data_leave_every_parameter_at_its_prior() {
    let s = exact(&DMatrix::zeros(0, 2), &[1.0, 2.0]);
    let fisher = s.fisher().unwrap();
    assert_eq!((fisher.rank(), s.silent()), (0, vec![0, 1]));
    assert!((fisher.posterior_covariance()[(1, 1)] - 4.0).abs() < 1e-15);
    assert_eq!(s.collinearity().all.parameters, [0_usize; 0]);
    assert_eq!(s.generalised(&fisher, &[]).unwrap(), vec![None, None]);
}

#[test]
fn the_collinearity_of_two_columns_follows_from_the_angle_between_them() {
    let angle: f64 = 0.1;
    let s = DMatrix::from_row_slice(
        3,
        3,
        &[3.0, 7.0 * angle.cos(), 0.0, 0.0, 7.0 * angle.sin(), 0.0, 0.0, 0.0, 1.0],
    );
    let c = exact(&s, &[1.0; 3]).collinearity();
    let expected = 1.0 / (1.0 - angle.cos()).sqrt();
    assert_eq!(c.subsets[0].parameters, [0, 1]);
    assert!((c.subsets[0].index.unwrap() - expected).abs() < 1e-9, "{c:?}");
    assert!((c.all.index.unwrap() - expected).abs() < 1e-9, "an orthogonal third column changes nothing");
    assert_eq!(c.subsets.len(), 4, "three pairs and one triple");
    assert!((c.growing[0].index.unwrap() - 1.0).abs() < 1e-12 && c.growing[1].parameters == [0, 1, 2]);
}

#[test]
fn wrong_shapes_and_infinite_numbers_are_refused() {
    let s = DMatrix::from_element(2, 2, 1.0);
    assert!(Sensitivities::new(&s, &[1.0], 0.0).is_err());
    assert!(Sensitivities::new(&s, &[1.0, f64::NAN], 0.0).is_err());
    assert!(Sensitivities::new(&DMatrix::zeros(2, 0), &[], 0.0).is_err());
    assert!(Sensitivities::new(&(s.clone() * f64::INFINITY), &[1.0, 1.0], 0.0).is_err());
    let s = exact(&s, &[1.0, 1.0]);
    assert!(s.generalised(&s.fisher().unwrap(), &[0]).is_err());
}

proptest! {
    /// Against the inverse of the normal equations where these are well conditioned.
    #[test]
    fn errors_and_directions_agree_with_the_normal_equations(
        values in proptest::collection::vec(-1.0_f64..1.0, 24),
        prior in proptest::collection::vec(0.1_f64..10.0, 3),
    ) {
        let s = DMatrix::from_row_slice(8, 3, &values) * 10.0;
        let f = s.tr_mul(&s);
        prop_assume!(f.clone().symmetric_eigen().eigenvalues.min() > 1.0);
        let fisher = exact(&s, &prior).fisher().unwrap();
        let inverse = f.clone().try_inverse().unwrap();
        let precision = DMatrix::from_fn(3, 3, |i, j| f[(i, j)] + if i == j { prior[i].powi(-2) } else { 0.0 });
        let posterior = precision.try_inverse().unwrap();
        // The normal equations lose twice the digits of a condition number up to 1e3 (sensitivities) times 1e2 (priors).
        prop_assert!((fisher.information() - &f).norm() < 1e-10 * f.norm());
        prop_assert!((fisher.posterior_covariance() - &posterior).norm() < 1e-8 * posterior.norm());
        for (j, error) in fisher.standard_errors().into_iter().enumerate() {
            prop_assert!((error.unwrap() / inverse[(j, j)].sqrt() - 1.0).abs() < 1e-8);
        }
        let weak = weak_directions(&posterior, &prior, 0.0);
        for (a, b) in weak.iter().zip(fisher.directions()) {
            prop_assert!((a.share / b.share - 1.0).abs() < 1e-6, "{a:?} {b:?}");
        }
    }

    /// Any matrix of small whole numbers, most of them of deficient rank: nothing panics, nothing is infinite.
    #[test]
    fn every_figure_is_finite_or_absent(values in proptest::collection::vec(-2_i32..3, 12), rows in 1_usize..4) {
        let values: Vec<f64> = values.into_iter().map(f64::from).collect();
        let s = exact(&DMatrix::from_row_slice(rows, 4, &values[..4 * rows]), &[1.0; 4]);
        let fisher = s.fisher().unwrap();
        prop_assert_eq!(fisher.rank(), DMatrix::from_row_slice(rows, 4, &values[..4 * rows]).rank(1e-9));
        prop_assert!(fisher.posterior_covariance().iter().all(|v| v.is_finite()));
        prop_assert!(fisher.standard_errors().into_iter().flatten().all(f64::is_finite));
        prop_assert!(fisher.correlation().iter().flatten().all(|c| c.abs() <= 1.0));
        for d in fisher.directions() {
            prop_assert!(d.coefficients.iter().all(|c| c.abs() <= 1.0 + 1e-12));
            prop_assert!(d.share > 0.0 && d.share <= 1.0);
            let unknown = DMatrix::from_row_slice(rows, 4, &values[..4 * rows]) * nalgebra::DVector::from_vec(d.coefficients);
            if d.standard_error.is_none() {
                prop_assert!(unknown.norm() < 1e-9, "a direction without information changes nothing");
            }
        }
        let c = s.collinearity();
        prop_assert!(c.subsets.iter().filter_map(|s| s.index).all(|g| (1.0..1e9).contains(&g)));
    }
}
