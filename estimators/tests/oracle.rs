//! One analysis against numbers computed elsewhere to 16 digits.
#![allow(clippy::unwrap_used)]
mod common;

use common::filter;
use nalgebra::DMatrix;
use starlings_estimators::{Analysis, Data, Filter, Gaussian, Noise, Points, Root};

/// 3 x 3, row by row.
fn square(rows: [f64; 9]) -> DMatrix<f64> {
    DMatrix::from_row_slice(3, 3, &rows)
}

fn one_step(values: &[f64]) -> Analysis {
    let roukf = filter(Points::Simplex, 2, Root::Symmetric);
    let particles = roukf.init(&Gaussian::independent(&[0.0, 0.0], &[1.0, 1.0]));
    let z = square([1.0, 2.0, 4.0, 0.0, 1.0, -1.0, 3.0, 0.0, 1.0]);
    let noise = Noise::Diagonal(vec![0.5, 1.0, 2.0]);
    roukf.analysis(&particles, &z, &Data { values, noise: &noise }).unwrap().1
}

fn assert_transform(analysis: &Analysis, expected: &DMatrix<f64>) {
    // The reference has 16 digits; a handful of roundings of numbers of order one.
    assert!((&analysis.transform - expected).amax() < 1e-12, "{}", analysis.transform);
}

#[test]
fn one_simplex_step_has_the_reference_transform_likelihood_and_nis() {
    let a = one_step(&[2.0, 0.5, 1.0]);
    assert_transform(
        &a,
        &square([
            0.720_115_377_321_328_2,
            0.051_645_084_799_573_47,
            0.288_414_592_583_693_2,
            0.152_666_237_243_045_46,
            0.957_808_359_461_324_7,
            0.252_763_915_330_640_74,
            0.127_218_385_435_626_14,
            -0.009_453_444_260_898_28,
            0.458_821_492_085_666,
        ]),
    );
    assert!((a.log_likelihood + 4.118_025_105_191).abs() < 1e-12);
    assert!((a.nis - 0.181_254_558_716).abs() < 1e-12);
    assert_eq!(a.n_used, 3);
    assert_eq!(a.information_lost.to_bits(), 0.0f64.to_bits());
}

#[test]
fn a_missing_row_gives_the_reference_transform() {
    let a = one_step(&[2.0, f64::NAN, 1.0]);
    assert_transform(
        &a,
        &square([
            0.765_354_958_923_328_8,
            0.045_630_275_611_341_64,
            0.335_380_187_862_185_9,
            0.062_329_686_220_378_99,
            0.977_576_668_043_098_6,
            0.156_557_299_960_491,
            0.172_315_354_856_292_04,
            -0.023_206_943_654_440_287,
            0.508_062_512_177_323,
        ]),
    );
    assert_eq!(a.n_used, 2);
    assert!(a.innovation[1].is_nan() && a.innovation_sd[1].is_nan());
}

#[test]
fn the_innovation_and_its_sd_are_in_the_units_of_the_rows() {
    let a = one_step(&[2.0, 0.5, 1.0]);
    // Rows of Z have means 7/3, 0, 4/3 and variances 14/9, 2/3, 14/9 (thirds); noise sd 0.5, 1, 2.
    let expected =
        [(2.0 - 7.0 / 3.0, 14.0 / 9.0 + 0.25), (0.5, 2.0 / 3.0 + 1.0), (1.0 - 4.0 / 3.0, 14.0 / 9.0 + 4.0)];
    for (k, (innovation, variance)) in expected.into_iter().enumerate() {
        assert!((a.innovation[k] - innovation).abs() < 1e-14);
        assert!((a.innovation_sd[k] - f64::sqrt(variance)).abs() < 1e-14);
    }
}
