//! The unloaded shape behind an image, and what it does to an estimated stiffness.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "exact comparisons and helpers of tests")]

use nalgebra::{DMatrix, DVector};
use starlings_haemodynamics::prestress::{Rings, unloaded};

const MMHG: f64 = 1333.22;

/// A tapered tube of fifteen rings in three regions of their own stiffness and thickness, in cm and dyn.
fn tube() -> (Rings, Vec<f64>) {
    let young: Vec<f64> = (0..15).map(|i| [2e6, 5e6, 1.2e6][i / 5]).collect();
    let thickness: Vec<f64> = (0..15).map(|i| 0.15 - 0.003 * i as f64).collect();
    let radii = (0..15).map(|i| 1.2 - 0.03 * i as f64).collect();
    (Rings::new(&young, &thickness, 0.5), radii)
}

fn loaded(rings: &Rings, radii: &[f64], pressure: f64) -> Vec<f64> {
    let mut loaded = vec![0.0; radii.len()];
    rings.load(radii, pressure, &mut loaded);
    loaded
}

/// Largest difference relative to the second list.
fn relative(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| ((a - b) / b).abs()).fold(0.0, f64::max)
}

#[test]
fn loading_the_reference_gives_the_image_back() {
    let (rings, radii) = tube();
    for pressure in [-5.0, 0.0, 80.0, 120.0, 400.0] {
        let image = loaded(&rings, &radii, pressure * MMHG);
        let found = rings.unloaded(&image, pressure * MMHG).unwrap();
        // The stated tolerance of the search is 1e-12 of the largest radius, the smallest is 0.65 of it.
        assert!(relative(&loaded(&rings, &found.shape, pressure * MMHG), &image) < 2e-12);
        assert!(relative(&found.shape, &radii) < 2e-12, "{pressure} mmHg: {:?}", found.shape);
        assert!(found.steps < 10, "{pressure} mmHg: {} steps", found.steps);
    }
}

#[test]
fn the_reference_of_a_ring_is_the_root_of_its_quadratic_even_where_the_fixed_point_runs_away() {
    let rings = Rings::new(&[2e6], &[0.1], 0.5);
    let beta = 2e6 * 0.1 / 0.75;
    for (strain, image) in [(0.01_f64, 1.0), (0.3, 1.0), (0.9, 2.0), (2.0, 0.5)] {
        // p R² + β R = β image with the strain (image − R)/R.
        let radius = image / (1.0 + strain);
        let pressure = beta * strain / radius;
        let found = rings.unloaded(&[image], pressure).unwrap();
        let root = 2.0 * image / (1.0 + (1.0 + 4.0 * pressure * image / beta).sqrt());
        assert!(relative(&found.shape, &[root]) < 2e-12 && relative(&[radius], &[root]) < 1e-14, "{found:?}");
    }
}

#[test]
fn rings_coupled_by_axial_tension_and_held_by_tissue_are_unloaded_alike() {
    let (rings, radii) = tube();
    let (n, pressure, tension, support) = (radii.len(), 90.0 * MMHG, 2e5, 3e4);
    // (β/R² + k_s) η − T d²η/dz² = p with free ends, cells of 1 cm.
    let load = |shape: &[f64], loaded: &mut [f64]| {
        let matrix = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => {
                let neighbours = if i == 0 || i == n - 1 { 1.0 } else { 2.0 };
                rings.membrane[i] / shape[i].powi(2) + support + tension * neighbours
            }
            1 => -tension,
            _ => 0.0,
        });
        let eta = matrix.lu().solve(&DVector::from_element(n, pressure)).unwrap();
        loaded.iter_mut().zip(shape).zip(&eta).for_each(|((l, x), eta)| *l = x + eta);
    };
    let mut image = vec![0.0; n];
    load(&radii, &mut image);
    let found = unloaded(&image, load).unwrap();
    let mut again = vec![0.0; n];
    load(&found.shape, &mut again);
    assert!(relative(&again, &image) < 2e-12 && relative(&found.shape, &radii) < 1e-11, "{found:?}");
    // The same tissue without tension, by the rings' own map.
    let held = Rings { support, ..rings };
    let image = loaded(&held, &radii, pressure);
    assert!(relative(&held.unloaded(&image, pressure).unwrap().shape, &radii) < 2e-12);
}

#[test]
fn a_wall_that_has_no_unloaded_shape_is_refused() {
    // Suction beyond collapse: R + p R²/β has no value above β/(4|p|).
    let rings = Rings::new(&[1e5], &[0.1], 0.5);
    let error = rings.unloaded(&[1.0], -40.0 * MMHG).unwrap_err().to_string();
    assert!(error.contains("no unloaded shape"), "{error}");
    let error = rings.unloaded(&[1.0, 1.0], 1.0).unwrap_err().to_string();
    assert!(error.contains("2 radii for 1 rings"), "{error}");
    assert!(unloaded(&[], |_, _| {}).is_err() && unloaded(&[f64::NAN], |_, _| {}).is_err());
}

/// The modulus that fits radii under pressures best, by golden section in its logarithm; `radius` predicts.
fn fitted(radii: &[(f64, f64)], radius: impl Fn(f64, f64) -> f64) -> f64 {
    let misfit = |log: f64| radii.iter().map(|(p, r)| (radius(log.exp2(), *p) - r).powi(2)).sum::<f64>();
    let (mut lo, mut hi, golden) = (15.0, 30.0, (5.0_f64.sqrt() - 1.0) / 2.0);
    for _ in 0..100 {
        let (a, b) = (hi - golden * (hi - lo), lo + golden * (hi - lo));
        if misfit(a) < misfit(b) { hi = b } else { lo = a }
    }
    f64::midpoint(lo, hi).exp2()
}

#[test]
fn an_image_taken_for_the_reference_makes_the_wall_stiffer_by_a_known_factor() {
    let (young, thickness, reference, diastole) = (5e6, 0.1, 1.0, 80.0 * MMHG);
    let ring = |young: f64| Rings::new(&[young], &[thickness], 0.5);
    let data: Vec<(f64, f64)> = (0..=10)
        .map(|k| diastole + 5.0 * MMHG * f64::from(k))
        .map(|p| (p, loaded(&ring(young), &[reference], p)[0]))
        .collect();
    let image = data[0].1;
    // With pre-stress: for each modulus, the reference that the image under the diastolic pressure implies.
    let right = fitted(&data, |young, p| {
        let found = ring(young).unloaded(&[image], diastole).unwrap();
        loaded(&ring(young), &found.shape, p)[0]
    });
    // The misfit is flat to rounding within 1e-8 of its minimum.
    assert!((right / young - 1.0).abs() < 1e-6, "{right:e}");
    // The image as reference and the pressure above diastole: the slope R²/β has the wrong R, exactly.
    let above = fitted(&data, |young, p| loaded(&ring(young), &[image], p - diastole)[0]);
    let factor = (image / reference).powi(2);
    assert!((above / young / factor - 1.0).abs() < 1e-6, "{above:e}");
    assert!((1.34..1.35).contains(&factor), "{factor}");
    // The image as reference under the whole pressure: the wall has to be stiff enough not to move at all.
    let whole = fitted(&data, |young, p| loaded(&ring(young), &[image], p)[0]);
    assert!(whole / young > 5.0, "{}", whole / young);
}
