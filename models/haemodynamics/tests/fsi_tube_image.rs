//! The tube whose radius is that of an image under pressure.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "exact comparisons and helpers of tests")]

mod fsi_tube_kit;

use fsi_tube_kit::{MM_HG, outputs, periodic, run, tube, values};
use starlings_haemodynamics::FsiTube;
use starlings_haemodynamics::fsi_tube::Layout;
use starlings_haemodynamics::prestress::Rings;
use starlings_models_core::Model;

const DIASTOLE: f64 = 80.0 * MM_HG;
/// A radius and a tissue that are not the default.
const TISSUE: [(&str, f64); 2] = [("R", 1.1), ("k_s", 4e4)];

fn imaged(pressure: f64) -> FsiTube {
    FsiTube::new(&Layout { image_pressure: pressure, ..Layout::default() }, 25.0).unwrap()
}

/// The unloaded radius of every cell, from the stiffness alone: k = E h/((1 − ν²)R_u²) + k_s.
fn unloaded(model: &FsiTube, theta: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let blocks = model.blocks(theta).unwrap();
    let young: Vec<f64> = (0..25).map(|i| theta[i / 5]).collect();
    let stiffness = (0..25).map(|i| blocks.stiffness[(i, i)] / (blocks.solid_mass[(i, i)] / (1.1 * 0.15)));
    let radius = |(k, e): (f64, &f64)| (e * 0.15 / (0.75 * (k - 4e4))).sqrt();
    (stiffness.zip(&young).map(radius).collect(), young)
}

#[test]
fn the_image_is_what_the_unloaded_tube_becomes_under_its_pressure() {
    let model = imaged(DIASTOLE);
    let theta = values(&model, &TISSUE);
    let (radii, young) = unloaded(&model, &theta);
    let rings = Rings { support: 4e4, ..Rings::new(&young, &[0.15; 25], 0.5) };
    let mut loaded = vec![0.0; 25];
    rings.load(&radii, DIASTOLE, &mut loaded);
    // The search ends at 1e-12; the way back through the stiffness costs a digit.
    assert!(loaded.iter().all(|r| (r - 1.1).abs() < 1e-11), "{loaded:?}");
    assert!(radii.iter().all(|r| (0.9..1.09).contains(r)), "{radii:?}");
    // And the model itself rests in the image under that pressure, without flow or with the flow that keeps it.
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(&theta, &mut x);
    assert!(x[..25].iter().all(|eta| eta.abs() < 1e-14), "{:?}", &x[..25]);
    let outflow = DIASTOLE / 1850.0;
    let y = outputs(
        &model,
        &values(&model, &[&TISSUE[..], &[("mu", 0.0), ("R_p", 0.0)]].concat()),
        outflow,
        0.0,
        &x,
    );
    let mut later = x.clone();
    let still = values(&model, &[&TISSUE[..], &[("mu", 0.0), ("R_p", 0.0)]].concat());
    for _ in 0..100 {
        fsi_tube_kit::advance(&model, &still, [outflow; 2], 1e-3, &mut later);
    }
    assert!(later[..25].iter().all(|eta| eta.abs() < 1e-12), "{:?}", &later[..25]);
    // Pressures of 1e5 to rounding.
    assert!((y[52] - DIASTOLE).abs() < 1e-9 && (y[50] - DIASTOLE).abs() < 1e-9, "{} {}", y[50], y[52]);
}

#[test]
fn steps_and_rates_of_a_tube_from_an_image_are_of_the_same_equations() {
    let model = imaged(DIASTOLE);
    let theta = values(&model, &TISSUE);
    let mut again = vec![0.0; model.spec().n_state()];
    model.initial(&theta, &mut again);
    run(&model, &theta, 1e-3, 1000, &mut again);
    // A midpoint step is second order accurate: its half difference quotient meets the rate in between.
    let (dt, q) = (1e-6, 100.0);
    let mut after = again.clone();
    fsi_tube_kit::advance(&model, &theta, [q, q], dt, &mut after);
    let middle: Vec<f64> = again.iter().zip(&after).map(|(a, b)| 0.5 * (a + b)).collect();
    let mut rate = vec![0.0; again.len()];
    let u = starlings_models_core::Drive { value: &[q], slope: &[0.0], history: &fsi_tube_kit::NoHistory };
    model.rhs(0.0, &middle, &theta, u, &mut rate);
    let scale: Vec<f64> = [(0..25, 1.0), (25..50, 1e3), (50..51, 1e5)]
        .into_iter()
        .flat_map(|(r, s)| r.map(move |_| s))
        .collect();
    for (i, rate) in rate.iter().enumerate() {
        let quotient = (after[i] - again[i]) / dt;
        // Differences of 1e-16 of the state over 1e-6 s.
        assert!((quotient - rate).abs() < 1e-6 * scale[i].max(rate.abs()), "{i}: {quotient} {rate}");
    }
}

#[test]
fn an_image_without_pressure_is_the_radius_without_load() {
    let (plain, imaged) = (tube(25, 1e-3), imaged(0.0));
    let theta = values(&plain, &TISSUE);
    assert_eq!(periodic(&plain, &theta, 4e-3), periodic(&imaged, &theta, 4e-3));
}

#[test]
fn displacements_differ_from_those_of_the_unloaded_tube_by_the_images_alone() {
    // Without fluid dynamics: at rest under a pressure, from the image and from the shape without load.
    let model = imaged(DIASTOLE);
    for pressure in [0.0, 60.0, 80.0, 120.0].map(|p| p * MM_HG) {
        let theta = values(&model, &[&TISSUE[..], &[("p0", pressure)]].concat());
        let mut x = vec![0.0; model.spec().n_state()];
        model.initial(&theta, &mut x);
        let (radii, young) = unloaded(&model, &theta);
        let rings = Rings { support: 4e4, ..Rings::new(&young, &[0.15; 25], 0.5) };
        let mut loaded = vec![0.0; 25];
        rings.load(&radii, pressure, &mut loaded);
        for (eta, radius) in x.iter().zip(&loaded) {
            // As above.
            assert!((1.1 + eta - radius).abs() < 1e-11, "{pressure}: {eta} {radius}");
        }
    }
}

#[test]
fn a_pressure_in_another_unit_is_refused_with_the_factor() {
    let refused = |pressure: f64| {
        let layout = Layout { image_pressure: pressure, ..Layout::default() };
        FsiTube::new(&layout, 25.0).err().map(|error| error.to_string())
    };
    // 80 mmHg as a bare number, and the highest number below the limit of 7.5 mmHg.
    for pressure in [80.0, 9_999.0] {
        let error = refused(pressure).unwrap();
        assert!(error.contains("image_pressure") && error.contains("mmHg x 1333.22"), "{error}");
    }
    assert_eq!(refused(1e4), None);
    assert_eq!(refused(0.0), None);
}

#[test]
fn an_image_under_suction_is_refused() {
    let layout = Layout { image_pressure: -1.0, ..Layout::default() };
    let error = FsiTube::new(&layout, 25.0).err().unwrap().to_string();
    assert!(error.contains("image_pressure") && error.contains("zero or above"), "{error}");
}
