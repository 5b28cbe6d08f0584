//! The portmanteau test against its definition, its size under white noise and its power under correlated noise.
#![allow(clippy::float_cmp)]

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use starlings_estimators::ljung_box;

fn white(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| StandardNormal.sample(&mut rng)).collect()
}

#[test]
fn one_lag_of_an_alternating_series_has_the_probability_of_its_definition() {
    // rho_1 = -3/4, Q = 4·6·(9/16)/3 = 4.5; a chi-square of one degree exceeds it with probability erfc(sqrt(2.25)).
    let p = ljung_box(&[1.0, -1.0, 1.0, -1.0], 1);
    assert!((p - 0.033_894_853_524_689_27).abs() < 1e-9, "{p}");
}

#[test]
fn white_series_are_called_coloured_as_often_as_the_level_says() {
    let n = 400;
    let alarms = (0..n).filter(|seed| ljung_box(&white(500, *seed), 25) < 0.05).count();
    // 20 ± 4.4 expected; three of these sd either way, and a little for the chi-square approximation.
    assert!((6..=36).contains(&alarms), "{alarms} of {n}");
}

#[test]
fn a_slow_series_is_called_coloured_also_with_gaps() {
    let mut last = 0.0;
    let mut series: Vec<f64> = white(400, 1)
        .into_iter()
        .map(|e| {
            last = 0.7 * last + e;
            last
        })
        .collect();
    series[100..140].fill(f64::NAN);
    assert!(ljung_box(&series, 20) < 1e-6);
}

#[test]
fn nothing_to_judge_gives_no_probability() {
    assert!(ljung_box(&[], 5).is_nan());
    assert!(ljung_box(&[1.0], 5).is_nan());
    assert!(ljung_box(&[2.0; 30], 5).is_nan());
    assert!(ljung_box(&[1.0, 2.0, 3.0], 0).is_nan());
}
