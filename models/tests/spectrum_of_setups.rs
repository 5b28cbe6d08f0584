//! The poles of a matrix, and those of whole setups: what it finds and what it refuses.

#![allow(clippy::float_cmp)]

#[path = "spectrum/check.rs"]
mod check;

use check::{close, names};
use nalgebra::DMatrix;
use starlings_models::catalogue::NATIVE;
use starlings_models::spectrum::{Decay, LinearisedSetup, SpectrumError, poles};
use starlings_models::{BuildSetup, ModelDef, Setup};

#[test]
fn a_cyclic_matrix_on_which_the_double_shift_stands_still_has_its_poles() {
    for n in [3, 4, 5, 8] {
        let a = DMatrix::from_fn(n, n, |i, j| if i == (j + 1) % n { 1.0 } else { 0.0 });
        for pole in poles(&a).expect("poles") {
            // Roots of unity, from a matrix of norm one.
            close(pole.norm(), 1.0, 1e-13, "modulus");
            close(pole.powu(u32::try_from(n).expect("small")).re, 1.0, 1e-12, "root of unity");
        }
    }
}

#[test]
fn a_small_pole_beside_large_entries_keeps_its_digits() {
    // Eigenvalues −0.51 and −2e5, and a coupling of 1e9 that balancing takes out.
    let a = DMatrix::from_row_slice(3, 3, &[-0.51, 1e9, 0.0, 0.0, -2e5, 1e4, 0.0, -1e-4, -3.0]);
    let found = poles(&a).expect("poles");
    // A block triangle: one eigenvalue is an entry.
    close(found[0].re, -0.51, 1e-13, "small pole");
}

#[test]
fn a_matrix_that_is_not_finite_is_refused() {
    let mut a = DMatrix::identity(3, 3);
    a[(1, 1)] = f64::NAN;
    assert_eq!(poles(&a), Err(SpectrumError::NotAMatrix { n: 3 }));
}

#[test]
fn six_hundred_poles_of_a_viscous_fluid_come_mode_by_mode_and_the_slow_ones_are_real() {
    let layout = Some(serde_json::json!({ "modes": 40, "polynomials": 14 }));
    let model = ModelDef { kind: "toy-fsi-stokes".to_owned(), layout, ..ModelDef::default() };
    let setup = Setup { model, outputs: names(&["displacement", "velocity"]), ..Setup::default() };
    let linearised =
        LinearisedSetup::new(setup.model().expect("a model"), &setup, &[], NATIVE).expect("linear");
    let listed = &linearised.poles()[..100];
    let expected = [-0.667_777_56, -0.671_269_96, -0.677_672_62, -0.687_737_60, -0.702_319_35];
    for (pole, expected) in listed.iter().zip(expected) {
        // Printed to eight decimals.
        close(pole.re, expected, 1e-8, "slow pole");
    }
    assert!(listed.iter().all(|pole| pole.im == 0.0), "the hundred slowest are real");
    for (kind, gain, most) in [("dvf", 1e3, 2e-8), ("sdf-displacement", 200.0, 9e-9), ("sdf", 200.0, 1.6e-4)]
    {
        let moved = linearised.observed(kind).expect("hosted").poles(gain).expect("poles");
        let change = listed.iter().zip(&moved).map(|(p, q)| (p - q).norm() / p.norm()).fold(0.0, f64::max);
        // A wall observer hardly moves what the viscous fluid alone decides. 1e-9 for rounding.
        assert!(change < 1.2 * most + 1e-9, "{kind}: {change}");
    }
}

#[test]
fn what_cannot_be_linearised_says_so() {
    let equations = |rate: &str, initial: &str| {
        let def = serde_json::json!({
            "states": [{ "name": "x", "unit": "", "role": "other", "initial": initial, "rate": [["x", rate]] }],
            "outputs": [{ "name": "y", "unit": "", "role": "other", "value": "x" }],
            "inputs": [], "replaceable": [], "solver": {},
        });
        let equations = Some(serde_json::from_value(def).expect("equations"));
        let model = ModelDef { kind: "equations".to_owned(), equations, ..ModelDef::default() };
        let setup = Setup { model, outputs: names(&["y"]), ..Setup::default() };
        LinearisedSetup::new(setup.model().expect("a model"), &setup, &[], NATIVE)
            .map(|linearised| linearised.poles().to_vec())
    };
    assert_eq!(equations("-2*x", "1").expect("linear")[0].re, -2.0);
    assert!(matches!(equations("-abs(x)", "0"), Err(SpectrumError::Switching { .. })));
    assert_eq!(equations("-abs(x)", "1").expect("smooth there")[0].re, -1.0);
    assert!(matches!(equations("-delay(y, 1)", "1"), Err(SpectrumError::Delayed { .. })));
    assert!(matches!(equations("-log(x)", "0"), Err(SpectrumError::NotFinite { .. })));
}

#[test]
fn a_setup_lists_why_it_cannot_host_an_observer() {
    let constants = [("R", 3.0), ("C", 0.1)].map(|(name, value)| (name.to_owned(), value));
    let model =
        ModelDef { kind: "windkessel-2".to_owned(), constants: constants.into(), ..ModelDef::default() };
    let setup = Setup { model, outputs: names(&["pressure"]), ..Setup::default() };
    let linearised =
        LinearisedSetup::new(setup.model().expect("a model"), &setup, &[], NATIVE).expect("linear");
    let observers = linearised.observers();
    assert!(observers.contains(&("nudging".to_owned(), None)));
    let why =
        observers.iter().find(|(kind, _)| kind == "sdf").and_then(|(_, why)| why.as_ref()).expect("refused");
    assert!(why.to_string().contains("models that can host it"), "{why}");
    let found = linearised.examine("nudging", &[0.0, 1.0], 5, Some(Decay::new(10.0, 0.1).expect("a decay")));
    let found = found.expect("hosted");
    close(found.gain_for_decay.expect("reached"), 10_f64.ln() / 0.1 - 1.0 / 0.3, 1e-7, "gain for the decay");
    close(found.slopes[0].analytic.expect("simple").re, -1.0, 1e-15, "slope");
}
