//! Strain and stress of the wall of both vessels against the balance of a ring.
#![allow(clippy::unwrap_used)]

mod artery_1d_kit;
mod fsi_tube_kit;

use starlings_haemodynamics::FsiTube;
use starlings_haemodynamics::fsi_tube::Layout;
use starlings_models_core::{Model, Spec};

/// The components of an output.
fn field<'a>(spec: &Spec, y: &'a [f64], name: &str) -> &'a [f64] {
    &y[Spec::range_of(&spec.outputs, name).unwrap()]
}

fn parameter(spec: &Spec, theta: &[f64], name: &str) -> f64 {
    theta[spec.parameters.iter().position(|q| q.name == name).unwrap()]
}

/// Outputs of a tube at rest under 100 000 dyn/cm², whose walls move outwards at so many cm/s.
fn tube_at_rest(model: &FsiTube, theta: &[f64], w: f64) -> Vec<f64> {
    let n = (model.spec().n_state() - 1) / 2;
    let mut x = vec![0.0; 2 * n + 1];
    model.initial(theta, &mut x);
    x[n..2 * n].fill(w);
    fsi_tube_kit::outputs(model, theta, 0.0, 0.0, &x)
}

#[test]
fn a_tube_at_rest_has_the_stress_of_laplace_with_and_without_an_image_pressure() {
    for image_pressure in [0.0, 9e4] {
        let layout = Layout { cells: 10, image_pressure, ..Layout::default() };
        let model = FsiTube::new(&layout, 25.0).unwrap();
        for k_s in [0.0, 3e4] {
            let theta = fsi_tube_kit::values(&model, &[("p0", 1e5), ("k_s", k_s)]);
            let (spec, y) = (model.spec(), tube_at_rest(&model, &theta, 0.0));
            let (radius, h) = (parameter(spec, &theta, "R"), parameter(spec, &theta, "h"));
            for k in 0..10 {
                let [eta, strain, stress] =
                    ["displacement", "strain", "stress"].map(|name| field(spec, &y, name)[k]);
                // From ε = (r − R_u)/R_u with the radius r = R + η.
                let unloaded = (radius + eta) / (1.0 + strain);
                let young = theta[k / 2];
                let elastic = young * strain / 0.75;
                assert!((stress / elastic - 1.0).abs() < 1e-12, "{stress} {elastic}");
                // σ h/R_u + k_s (r − R_u) = p: a few roundings, and the search for the unloaded radius.
                let held = stress * h / unloaded + k_s * (radius + eta - unloaded);
                assert!((held / 1e5 - 1.0).abs() < 1e-9, "{held} under {image_pressure}");
                assert!((image_pressure > 0.0) == (unloaded < radius - 1e-3), "{unloaded}");
            }
        }
    }
}

#[test]
fn a_wall_in_motion_is_stressed_by_its_own_viscosity_and_not_by_that_of_the_tissue() {
    let model = fsi_tube_kit::tube(10, 1e-3);
    let theta = fsi_tube_kit::values(&model, &[("c_w", 3e3), ("c_s", 5e4)]);
    let spec = model.spec();
    let [still, moving] = [0.0, 2.0].map(|w| tube_at_rest(&model, &theta, w));
    for (a, b) in field(spec, &still, "stress").iter().zip(field(spec, &moving, "stress")) {
        // c_w w R/h = 3000 · 2 / 0.15, next to a stress of some 7e5: rounding of that.
        assert!((b - a - 4e4).abs() < 1e-8, "{a} {b}");
    }
}

#[test]
fn the_pressure_in_every_cell_of_a_driven_artery_is_what_wall_and_tissue_hold() {
    let model = artery_1d_kit::tube(20, 5, 0.7);
    let own = [("E2", 1e7), ("E4", 3e6), ("c_w", 3e3), ("k_s", 2e4), ("p_ext", 4e3)];
    let theta = artery_1d_kit::theta(&model, &own);
    let mut x = artery_1d_kit::start(&model, &theta);
    artery_1d_kit::drive(&model, &theta, &mut x, 0..12, 1e-2, &fsi_tube_kit::inflow);
    let y = artery_1d_kit::outputs(&model, &theta, &x, fsi_tube_kit::inflow(0.12));
    let (spec, mut largest) = (model.spec(), 0.0_f64);
    for k in 0..20 {
        let [displacement, pressure, strain, stress] =
            ["displacement", "pressure", "strain", "stress"].map(|name| field(spec, &y, name)[k]);
        let rest = displacement / strain;
        let held = stress * 0.15 / rest + 2e4 * displacement + 4e3;
        assert!((held / pressure - 1.0).abs() < 1e-12, "{held} {pressure}");
        largest = largest.max(stress);
    }
    // Laplace at 110 mmHg or so with R/h of about six: some 9e5, more where the wall is wide.
    assert!((5e5..3e6).contains(&largest), "{largest}");
}
