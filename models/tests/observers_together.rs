//! Observers side by side: their poles, and the states that each corrects.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix};
use starlings_models::catalogue::NATIVE;
use starlings_models::observer::{self, Wiring};
use starlings_models::spectrum::{LinearisedSetup, observed};
use starlings_models::{BuildSetup, ObserverDef, Setup};

fn def(kind: &str, gain: f64) -> ObserverDef {
    ObserverDef { kind: kind.to_owned(), gain, ..ObserverDef::default() }
}

/// A system with a wall and a Windkessel at values of an artery, under a pair of observers.
fn pair(kind: &str, first: ObserverDef, second: ObserverDef) -> (Setup, Vec<f64>) {
    let (mut setup, mut theta) = common::setup(kind);
    let values = [("E", 5e6), ("R_p", 150.0), ("R_d", 1850.0), ("C", 1e-3), ("p_0", 1e5), ("p0", 1e5)];
    let values: BTreeMap<&str, f64> = values.into();
    for (name, value) in setup.parameters.iter().zip(&mut theta) {
        if let Some(given) = values.get(name.as_str()) {
            *value = *given;
        }
    }
    setup.observer = ObserverDef { beside: vec![second], ..first };
    (setup, theta)
}

fn linearised(setup: &Setup, theta: &[f64]) -> LinearisedSetup {
    LinearisedSetup::new(setup.model().unwrap(), setup, theta, NATIVE).unwrap()
}

/// Largest distance from a pole to the nearest of the others, each taken once.
fn apart(found: &[Complex<f64>], dense: &[Complex<f64>]) -> f64 {
    assert_eq!(found.len(), dense.len());
    let mut left = dense.to_vec();
    let mut most: f64 = 0.0;
    for pole in found {
        let distance = |at: &usize| (left[*at] - pole).norm();
        let nearest = (0..left.len()).min_by(|i, j| distance(i).total_cmp(&distance(j))).unwrap();
        most = most.max((left.swap_remove(nearest) - pole).norm());
    }
    most
}

#[test]
fn the_poles_of_a_pair_are_the_eigenvalues_of_the_model_less_both_feedbacks() {
    for kind in ["toy-fsi-windkessel", "fsi-tube"] {
        let (setup, theta) = pair(kind, def("sdf", 20.0), def("windkessel", 5.0));
        let found = linearised(&setup, &theta).observed("sdf + windkessel").unwrap();
        let model = setup.model().unwrap();
        let (spec, outputs) = (model.spec(), &setup.outputs[..]);
        let wiring = Wiring { spec, outputs, model: &*model, theta: &theta, native: NATIVE };
        for gain in [0.0, 20.0, 200.0] {
            // Both gains in proportion: a quarter of the first for the second.
            let at = ObserverDef { beside: vec![def("windkessel", 0.25 * gain)], ..def("sdf", gain) };
            let together = observer::build(&at, wiring).unwrap();
            let mut matrix: DMatrix<f64> = observed(&*model, &theta, &*together).unwrap();
            // Rows of displacements, velocities and a pressure: balanced, for the sake of the digits.
            balance_parlett_reinsch(&mut matrix);
            let dense: Vec<Complex<f64>> = matrix.complex_eigenvalues().iter().copied().collect();
            let size = dense.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
            let off = apart(&found.poles(gain).unwrap(), &dense) / size;
            assert!(off < 1e-9, "{kind} at {gain}: {off:e} of {size}");
        }
    }
}

#[test]
fn a_pair_decays_faster_than_either_observer_alone() {
    let (setup, theta) = pair("toy-fsi-windkessel", def("sdf", 200.0), def("windkessel", 10.0));
    let (together, alone) = linearised(&setup, &theta).together_and_alone().unwrap();
    assert!(together < alone[0] && together < alone[1], "{together} and {alone:?}");
}

#[test]
fn a_state_that_two_observers_correct_is_named() {
    let shared = |first: &str, second: &str| {
        let (setup, theta) = pair("fsi-tube", def(first, 20.0), def(second, 5.0));
        linearised(&setup, &theta).shared_state().unwrap()
    };
    assert_eq!(shared("sdf", "windkessel"), None);
    assert_eq!(shared("sdf", "dvf"), None, "one corrects displacements, the other velocities");
    assert_eq!(shared("sdf", "nudging"), Some((0, 1, "eta[0]".to_owned())));
    assert_eq!(shared("dvf", "dvf-am"), Some((0, 1, "w[0]".to_owned())));
}
