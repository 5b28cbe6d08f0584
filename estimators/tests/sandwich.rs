//! Intervals given the residuals: white and correlated errors on linear models, records, channels, and data that say nothing.
#![allow(clippy::unwrap_used)]
mod common;

use common::{gauss, rng};
use nalgebra::{DMatrix, DVector};
use starlings_estimators::{DataPoint, EstimatorError, Residuals};

/// Sensitivities like those of a stiffness, a damping and an offset.
fn design(n: usize) -> DMatrix<f64> {
    DMatrix::from_fn(n, 3, |k, j| {
        let t = 8.0 * k as f64 / n as f64;
        [60.0 * t * (5.0 * t).sin(), 20.0 * (3.0 * t).cos(), 30.0][j]
    })
}

fn places(n: usize) -> Vec<DataPoint> {
    (0..n).map(|k| DataPoint { record: 0, time: k as f64, channel: 0 }).collect()
}

/// Errors of an autoregression of first order of the given sd, with white noise of sd one.
fn errors(n: usize, rho: f64, sd: f64, seed: u64) -> DVector<f64> {
    let mut g = rng(seed);
    let mut x = gauss(&mut g);
    DVector::from_fn(n, |_, _| {
        x = rho * x + (1.0 - rho * rho).sqrt() * gauss(&mut g);
        gauss(&mut g) + sd * x
    })
}

/// Errors of the estimate in sd at the stated noise, the residuals that it leaves, and what those widen the interval by.
fn fitted(jacobian: &DMatrix<f64>, errors: &DVector<f64>, places: &[DataPoint]) -> (DVector<f64>, Vec<f64>) {
    let p = jacobian.ncols();
    let inverse = (DMatrix::identity(p, p) + jacobian.tr_mul(jacobian)).try_inverse().unwrap();
    let off = &inverse * jacobian.tr_mul(errors);
    let residual = errors - jacobian * &off;
    let inflation = Residuals { jacobian, values: &residual, places }.inflation().unwrap().unwrap();
    (off.component_div(&inverse.diagonal().map(f64::sqrt)), inflation)
}

/// Shares of the true values within the 95 % intervals at the stated noise and given the residuals.
fn coverage(n: usize, rho: f64, sd: f64, twins: u64) -> (f64, f64) {
    let (jacobian, places) = (design(n), places(n));
    let (mut stated, mut given, mut all) = (0, 0, 0);
    for seed in 0..twins {
        let (off, inflation) = fitted(&jacobian, &errors(n, rho, sd, 1000 + seed), &places);
        for (off, inflation) in off.iter().zip(inflation) {
            stated += u32::from(off.abs() < 1.96);
            given += u32::from(off.abs() < 1.96 * inflation);
            all += 1;
        }
    }
    (f64::from(stated) / f64::from(all), f64::from(given) / f64::from(all))
}

#[test]
fn with_white_noise_both_intervals_hold_the_truth_as_often_as_they_say() {
    // 900 intervals: the standard error of a share of .95 is .007.
    let (stated, given) = coverage(150, 0.0, 0.0, 300);
    assert!((0.92..=0.97).contains(&stated) && (0.92..=0.97).contains(&given), "{stated} {given}");
}

#[test]
fn with_correlated_errors_the_interval_given_the_residuals_holds_the_truth() {
    for (n, rho) in [(150, 0.5), (150, 0.9), (460, 0.98)] {
        let (stated, given) = coverage(n, rho, 2.0, 200);
        assert!(stated < 0.6 && given >= 0.88, "{n} {rho}: {stated} {given}");
    }
}

#[test]
fn residuals_that_are_larger_but_white_widen_by_their_size() {
    let (jacobian, places) = (design(400), places(400));
    let (_, inflation) = fitted(&jacobian, &(3.0 * errors(400, 0.0, 0.0, 5)), &places);
    // The size of 400 numbers is known to 4 %, the larger of two estimates and Student's t add a few percent.
    assert!(inflation.iter().all(|f| (2.7..3.7).contains(f)), "{inflation:?}");
}

#[test]
fn channels_that_err_together_count_once_and_records_by_their_own_errors() {
    let n = 300;
    let one = design(n);
    let e = errors(n, 0.0, 0.0, 9);
    let twice = |f: &dyn Fn(usize) -> DataPoint| (0..2 * n).map(f).collect::<Vec<_>>();
    let jacobian = DMatrix::from_fn(2 * n, 3, |k, j| one[(k / 2, j)]);
    let same = DVector::from_fn(2 * n, |k, _| e[k / 2]);
    let channels = twice(&|k| DataPoint { record: 0, time: (k / 2) as f64, channel: k % 2 });
    let (_, inflation) = fitted(&jacobian, &same, &channels);
    // Two copies of one channel say what one says: sqrt 2, known as well as the size of 300 numbers, and a few percent of t.
    assert!(inflation.iter().all(|f| (1.30..1.75).contains(f)), "{inflation:?}");
    let stacked = DMatrix::from_fn(2 * n, 3, |k, j| one[(k % n, j)]);
    let records = twice(&|k| DataPoint { record: k / n, time: (k % n) as f64, channel: 0 });
    let (_, inflation) = fitted(&stacked, &errors(2 * n, 0.0, 0.0, 11), &records);
    assert!(inflation.iter().all(|f| *f < 1.3), "{inflation:?}");
}

#[test]
fn a_record_that_errs_as_a_whole_is_an_error_of_its_own() {
    // Six records with an offset each, the parameter a common level: what counts is six numbers.
    let (n_record, n) = (6, 40);
    let jacobian = DMatrix::from_element(n_record * n, 1, 10.0);
    let mut g = rng(3);
    let offset: Vec<f64> = (0..n_record).map(|_| 3.0 * gauss(&mut g)).collect();
    let noise = errors(n_record * n, 0.0, 0.0, 4);
    let all = DVector::from_fn(n_record * n, |k, _| offset[k / n] + noise[k]);
    let places: Vec<DataPoint> =
        (0..n_record * n).map(|k| DataPoint { record: k / n, time: (k % n) as f64, channel: 0 }).collect();
    let (_, inflation) = fitted(&jacobian, &all, &places);
    // The level is known to 3 / sqrt 6 instead of 1 / sqrt 240: nineteen times; six numbers know that to a third.
    assert!((9.0..40.0).contains(&inflation[0]), "{inflation:?}");
}

#[test]
fn residuals_without_a_message_leave_the_interval_as_it_is() {
    let (jacobian, all) = (design(60), places(60));
    let of =
        |values: DVector<f64>| Residuals { jacobian: &jacobian, values: &values, places: &all }.inflation();
    assert_eq!(of(DVector::zeros(60)), Ok(Some(vec![1.0; 3])), "no residual at all");
    assert_eq!(of(1e-12 * errors(60, 0.0, 0.0, 1)), Ok(Some(vec![1.0; 3])), "residuals below the noise");
    let constant = of(DVector::from_element(60, 5.0)).unwrap().unwrap();
    assert!(constant.iter().all(|f| f.is_finite() && *f >= 1.0), "{constant:?}");
    let unread = DMatrix::zeros(60, 2);
    let values = errors(60, 0.9, 2.0, 2);
    let inflation = Residuals { jacobian: &unread, values: &values, places: &all }.inflation();
    assert_eq!(inflation, Ok(Some(vec![1.0; 2])), "a parameter that no datum feels keeps its prior");
    let mut broken = values.clone();
    broken[7] = f64::NAN;
    let refused = Err(EstimatorError::NotFinite { what: "a residual or its slope" });
    assert_eq!(of(broken), refused);
}

#[test]
fn too_few_residuals_say_nothing_of_their_correlation() {
    for n in 1..11 {
        let (jacobian, all) = (design(n), places(n));
        let values = errors(n, 0.5, 1.0, 8);
        assert_eq!(
            Residuals { jacobian: &jacobian, values: &values, places: &all }.inflation(),
            Ok(None),
            "{n}"
        );
    }
    let (jacobian, all) = (design(11), places(11));
    let values = errors(11, 0.5, 1.0, 8);
    let inflation =
        Residuals { jacobian: &jacobian, values: &values, places: &all }.inflation().unwrap().unwrap();
    assert!(inflation.iter().all(|f| f.is_finite() && *f >= 1.0), "{inflation:?}");
}

#[test]
fn times_that_are_uneven_or_missing_are_taken_as_they_are() {
    // Errors of a long memory, seen at a third of the times: the correlation is one of time, not of rows.
    let n = 600;
    let (jacobian, e) = (design(n), errors(n, 0.97, 2.0, 21));
    let kept: Vec<usize> = (0..n).filter(|k| (k * k) % 7 < 3).collect();
    let thin = jacobian.select_rows(&kept);
    let at: Vec<DataPoint> =
        kept.iter().map(|k| DataPoint { record: 0, time: *k as f64, channel: 0 }).collect();
    let (_, whole) = fitted(&jacobian, &e, &places(n));
    let (_, part) = fitted(&thin, &DVector::from_fn(kept.len(), |i, _| e[kept[i]]), &at);
    // A third of the rows are a third of the stated information; the errors hardly say less for it.
    for (whole, part) in whole.iter().zip(&part) {
        assert!(*whole > 1.5 && *part > 1.2 && part < whole, "{whole} {part}");
    }
}
