//! Observers of a wall on the oscillator: closed-form poles, and the decay of errors in whole runs.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "exact comparisons and helpers of tests")]

mod common;
#[path = "../core/tests/dense_wall/mod.rs"]
mod dense_wall;

use common::{kinds, largest_difference, run, setup, window};
use dense_wall::{channels, poles};
use nalgebra::DMatrix;
use starlings_models::catalogue::NATIVE;
use starlings_models::observer::{self, Wiring};
use starlings_models::{BuildSetup, ObserverDef, Setup, Window};

const THETA: [f64; 3] = [2.0, 0.0, 18.0];
const OMEGA: f64 = 3.0;

fn def(kind: &str, gain: f64) -> ObserverDef {
    ObserverDef { kind: kind.to_owned(), gain, ..ObserverDef::default() }
}

fn observed(kind: &str, gain: f64) -> Setup {
    Setup { observer: def(kind, gain), ..setup("oscillator").0 }
}

/// A − Γ with both outputs observed.
fn closed(kind: &str, gain: f64) -> DMatrix<f64> {
    let model = setup("oscillator").0.model().unwrap();
    let outputs = channels(&["position", "velocity"]);
    let wiring =
        Wiring { spec: model.spec(), outputs: &outputs, model: &*model, theta: &THETA, native: NATIVE };
    let feedback = observer::build(&def(kind, gain), wiring).unwrap().feedback(&*model, &THETA);
    DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -OMEGA * OMEGA, 0.0]) - feedback
}

#[test]
fn feedback_of_velocity_or_displacement_gives_the_poles_of_a_damped_oscillator() {
    for kind in ["dvf", "dvf-am", "sdf", "sdf-displacement"] {
        for gain in [0.5, 4.0, 5.5, 20.0_f64] {
            // λ² + γλ + ω² = 0.
            let square = OMEGA * OMEGA - gain * gain / 4.0;
            let want = if square > 0.0 {
                [(-square.sqrt(), -gain / 2.0), (square.sqrt(), -gain / 2.0)]
            } else {
                let root = (-square).sqrt();
                [(0.0, -gain / 2.0 - root), (0.0, -gain / 2.0 + root)]
            };
            for (got, want) in poles(&closed(kind, gain)).iter().zip(want) {
                let difference = (got.0 - want.0).abs() + (got.1 - want.1).abs();
                // Two by two: rounding.
                assert!(difference < 1e-13 * gain.max(1.0), "{kind}, gain {gain}: {got:?} {want:?}");
            }
        }
    }
}

#[test]
fn an_image_force_shifts_the_frequency_and_damps_nothing() {
    for gain in [0.5, 4.0, 100.0_f64] {
        let want = (OMEGA * OMEGA + gain * gain).sqrt();
        for ((im, re), sign) in poles(&closed("image-force", gain)).into_iter().zip([-1.0, 1.0]) {
            assert!(re.abs() < 1e-13 * want && (im - sign * want).abs() < 1e-13 * want, "{re} + {im}i");
        }
    }
}

/// State error at time 1 of a run that starts from a wrong position, corrected `n` times.
fn final_error(kind: &str, gain: f64, n: usize) -> Vec<f64> {
    let mut window = window(&setup("oscillator").0, n);
    window.observed = run(&*observed("none", 0.0).build().unwrap(), &window, &THETA).outputs;
    let mut setup = observed(kind, gain);
    let truth = run(&*setup.build().unwrap(), &window, &THETA).state;
    setup.model.constants.insert("initial:x".to_owned(), 3.0);
    let state = run(&*setup.build().unwrap(), &window, &THETA).state;
    state.iter().zip(&truth).map(|(a, b)| a - b).collect()
}

#[test]
fn a_wrong_start_decays_in_a_run_as_the_feedback_matrix_says() {
    for kind in ["dvf", "dvf-am", "sdf", "sdf-displacement", "image-force"] {
        // The momentum form of the solid feedback steps as `sdf` does where there is no fluid.
        let a = closed(if kind == "sdf-displacement" { "sdf" } else { kind }, 4.0);
        let want = a.exp() * DMatrix::from_column_slice(2, 1, &[2.0, 0.0]);
        let [coarse, fine] =
            [500, 1000].map(|n| largest_difference(&final_error(kind, 4.0, n), want.as_slice()));
        // Steps of first order: halved with the step.
        assert!(fine < 2e-2 && (coarse / fine - 2.0).abs() < 0.05, "{kind}: {coarse:e} {fine:e}");
    }
}

#[test]
fn on_data_of_the_true_model_a_run_does_not_move_with_the_gain() {
    let mut window = window(&setup("oscillator").0, 40);
    let truth = run(&*observed("none", 0.0).build().unwrap(), &window, &THETA);
    window.observed.clone_from(&truth.outputs);
    for kind in ["dvf", "dvf-am", "sdf", "sdf-displacement", "image-force"] {
        for gain in [0.1, 1e6] {
            // Bitwise: every innovation is exactly zero.
            let got = run(&*observed(kind, gain).build().unwrap(), &window, &THETA);
            assert_eq!(got, truth, "{kind}, gain {gain}");
        }
    }
}

#[test]
fn implicit_corrections_are_stable_at_any_gain_and_the_explicit_one_up_to_its_limit() {
    let largest = |kind: &str, gain: f64| {
        let window = Window { observed: vec![0.0; 400], ..window(&setup("oscillator").0, 200) };
        let state = run(&*observed(kind, gain).build().unwrap(), &window, &THETA).state;
        state[0].abs().max(state[1].abs() / gain)
    };
    for kind in ["dvf", "dvf-am", "sdf", "sdf-displacement"] {
        assert!(largest(kind, 1e7) < 1.0, "{kind}: {}", largest(kind, 1e7));
    }
    // Δt = 1/200: the limit of a wave that the data resolve well, ωΔt = 0.015, is a gain of 2/Δt = 400 but for 1e-4 of it.
    assert!(largest("image-force", 396.0) < 10.0, "{}", largest("image-force", 396.0));
    assert!(largest("image-force", 404.0) > 1e6, "{}", largest("image-force", 404.0));
}

#[test]
fn the_largest_stable_gain_of_an_image_force_is_where_runs_begin_to_grow_at_any_spacing() {
    for dt in [0.005, 0.3, 0.6, 0.9] {
        let model = setup("oscillator").0.model().unwrap();
        let outputs = channels(&["position", "velocity"]);
        let wiring =
            Wiring { spec: model.spec(), outputs: &outputs, model: &*model, theta: &THETA, native: NATIVE };
        let image_force = observer::build(&def("image-force", 1.0), wiring).unwrap();
        let most = image_force.stable_up_to(&*model, &THETA, dt).unwrap();
        let largest = |gain: f64| {
            let times = (1..=200).map(|j| f64::from(j) * dt).collect();
            let window =
                Window { start: 0.0, times, observed: vec![0.0; 400], inputs: vec![], since: vec![] };
            let state = run(&*observed("image-force", gain).build().unwrap(), &window, &THETA).state;
            state[0].abs().max(state[1].abs() / OMEGA)
        };
        // One in a hundred of the gain to either side; growth by at least 1 % of some eigenvalue over 200 steps.
        assert!(
            largest(0.99 * most) < 20.0 * (1.0 / (OMEGA * dt)).max(1.0),
            "Δt {dt}: {}",
            largest(0.99 * most)
        );
        assert!(largest(1.01 * most) > 1e4, "Δt {dt}: {}", largest(1.01 * most));
        // γ² + ω² < (2/Δt)² is enough wherever it can be kept.
        assert!(most * most + OMEGA * OMEGA > (2.0 / dt).powi(2), "Δt {dt}: {most}");
    }
}

#[test]
fn a_model_without_a_wall_is_refused_with_those_that_have_one() {
    let error = |kind: &str, model: &str| {
        let setup = Setup { observer: def(kind, 1.0), ..setup(model).0 };
        setup.build().err().map(|error| error.to_string()).unwrap()
    };
    for kind in ["dvf", "dvf-am", "sdf", "sdf-displacement", "image-force"] {
        let error = error(kind, "windkessel-2");
        assert!(error.contains(&format!("`{kind}` cannot be hosted by the model `windkessel-2`")), "{error}");
        assert!(error.contains("`driven-oscillator`") && error.contains("`nudging`"), "{error}");
    }
    let error = error("windkessel", "oscillator");
    assert!(error.contains("cannot be hosted by the model `oscillator`"), "{error}");
}

#[test]
fn the_models_that_a_refusal_names_are_those_that_can_be_built() {
    for kind in ["dvf", "dvf-am", "sdf", "sdf-displacement", "image-force", "windkessel"] {
        let told = |model: &str| {
            let (mut setup, _) = setup(model);
            setup.observer = def(kind, 1.0);
            setup.outputs = setup.spec().unwrap().outputs.iter().map(|q| q.name.clone()).collect();
            setup.build().err().map(|error| error.to_string())
        };
        let refusal = told("windkessel-2").unwrap();
        let mut hosts = 0;
        for model in kinds() {
            let hosted = told(&model).is_none();
            assert_eq!(
                refusal.contains(&format!("`{model}`")),
                hosted || model == "windkessel-2",
                "{kind} on {model}: {refusal}"
            );
            hosts += usize::from(hosted);
        }
        assert!(hosts > 0, "{kind}");
        assert_eq!(refusal.contains("`artery-1d`"), ["sdf", "windkessel"].contains(&kind), "{refusal}");
    }
}

#[test]
fn a_pairing_of_outputs_and_states_is_refused_by_an_observer_that_has_its_own() {
    let mut setup = observed("sdf", 1.0);
    setup.observer.corrects.insert("velocity".to_owned(), "x".to_owned());
    let error = setup.build().err().map(|error| error.to_string()).unwrap();
    assert!(error.contains("remove `corrects`"), "{error}");
}
