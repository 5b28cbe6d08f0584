//! Scores on small problems, and the largest of many by chance.

use super::*;

fn line(n: usize, f: impl Fn(f64) -> f64) -> DVector<f64> {
    DVector::from_fn(n, |i, _| f(i as f64 / n as f64))
}

#[test]
fn a_missing_slope_is_found_with_its_size_and_gain() {
    // Fitted: a constant; missing: 3 t. The gain is what least squares with both columns would win.
    let n = 200;
    let constant = DMatrix::from_element(n, 1, 1.0);
    let residual = line(n, |t| 3.0 * (t - 0.4975));
    let none = DVector::zeros(1);
    let fit = Optimum::new(&residual, &constant, &none, &none).expect("well posed");
    let score = fit.score(&line(n, |t| t));
    // Exact up to rounding, since the model is linear.
    assert!((score.amplitude - 3.0).abs() < 1e-10, "{score:?}");
    assert!((score.gain - residual.norm_squared()).abs() < 1e-8 * score.gain);
    assert!((score.sd * line(n, |t| t - 0.4975).norm() - 1.0).abs() < 1e-10);
}

#[test]
fn what_the_parameters_imitate_has_no_gain() {
    let n = 100;
    let jacobian = DMatrix::from_columns(&[line(n, |_| 1.0), line(n, |t| t)]);
    let none = DVector::zeros(2);
    let fit = Optimum::new(&line(n, |t| (9.0 * t).sin()), &jacobian, &none, &none).expect("well posed");
    let score = fit.score(&line(n, |t| 2.0 - 5.0 * t));
    assert!(score.identifiable < 1e-12 && fit.score(&line(n, |t| t * t)).identifiable > 1e-3, "{score:?}");
}

#[test]
fn a_prior_that_was_pulled_gives_the_new_parameter_room() {
    // Prior 0 +- 0.1 on a constant, data at 1: the offset is all the new parameter's if it is the same constant.
    let n = 50;
    let one = DMatrix::from_element(n, 1, 1.0);
    let precision = DVector::from_element(1, 100.0);
    let estimate = 50.0 / 150.0;
    let residual = line(n, |_| 1.0 - estimate);
    let fit = Optimum::new(&residual, &one, &precision, &DVector::from_element(1, -estimate)).expect("posed");
    let score = fit.score(&line(n, |_| 1.0));
    // With it the constant returns to its prior mean and the amplitude is 1: the gain is the whole cost.
    let cost = residual.norm_squared() + 100.0 * estimate * estimate;
    assert!((score.amplitude - 1.0).abs() < 1e-10 && (score.gain - cost).abs() < 1e-8, "{score:?}");
}

/// Standard normal numbers by Box and Muller from a linear congruence.
fn standard_normal() -> impl FnMut() -> f64 {
    let mut state = 12345_u64;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    move || (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
}

/// The correlation of these columns, a few held at a time.
fn unit(own: &DMatrix<f64>) -> DMatrix<f64> {
    let column = |i: usize| Ok::<_, std::convert::Infallible>(own.column(i).into_owned());
    score_correlation(own.ncols(), 3, column).unwrap_or_default()
}

#[test]
fn the_correlation_does_not_depend_on_how_many_columns_are_held() {
    let own = DMatrix::from_fn(50, 7, |i, j| (0.3 * (i * (j + 1)) as f64).sin() * (j as f64));
    let column = |i: usize| Ok::<_, std::convert::Infallible>(own.column(i).into_owned());
    let Ok(all) = score_correlation(7, 7, column);
    for at_a_time in [0, 1, 2, 3, 6, 100] {
        let Ok(some) = score_correlation(7, at_a_time, column);
        assert_eq!(some, all, "{at_a_time}");
    }
    assert!(all[(0, 0)].abs() < f64::MIN_POSITIVE, "a column of length zero stays so");
    assert!((1..7).all(|k| (all[(k, k)] - 1.0).abs() < 1e-15));
}

#[test]
fn the_largest_of_independent_scores_has_the_quantile_of_its_number() {
    let own = DMatrix::<f64>::identity(10, 10);
    let mut normal = standard_normal();
    let maxima = null_maxima(unit(&own), &[0.0; 10], 4000, &mut normal);
    // P(max of ten chi-square(1) > 7.88) = 1 - (1 - 0.005)^10 = 0.0489; its standard error over 4000 is 0.0034.
    let share = maxima.iter().filter(|m| **m > 7.879).count() as f64 / 4000.0;
    assert!((share - 0.0489).abs() < 0.014, "{share}");
    let one_sided = null_maxima(unit(&own), &[1.0; 10], 4000, &mut normal);
    let share = one_sided.iter().filter(|m| **m > 7.879).count() as f64 / 4000.0;
    assert!((share - 0.0247).abs() < 0.01, "{share}");
}

#[test]
fn many_scores_have_the_quantile_of_their_number_and_repeated_ones_count_once() {
    let k = SPECTRAL + 8;
    let mut normal = standard_normal();
    let independent = null_maxima(unit(&DMatrix::identity(k, k)), &vec![0.0; k], 4000, &mut normal);
    // P(max of 520 chi-square(1) > 15.137) = 1 - (1 - 0.0001)^520 = 0.0507; its standard error over 4000 is 0.0035.
    let share = independent.iter().filter(|m| **m > 15.137).count() as f64 / 4000.0;
    assert!((share - 0.0507).abs() < 0.014, "{share}");
    let repeated = null_maxima(unit(&DMatrix::from_element(3, k, 1.0)), &vec![0.0; k], 4000, &mut normal);
    // All are one: P(chi-square(1) > 3.841) = 0.05. The ridge makes them differ by 1e-5.
    let share = repeated.iter().filter(|m| **m > 3.841).count() as f64 / 4000.0;
    assert!((share - 0.05).abs() < 0.014, "{share}");
}
