//! Observers inside a run: what they may move and what they may not.
#![allow(clippy::float_cmp, clippy::unwrap_used, reason = "exact comparisons and helpers of tests")]

mod common;

use common::{kinds, largest_difference, run, run_in_pieces, setup, window};
use starlings_models::observer;
use starlings_models::{BuildSetup, ModelDef, ObserverDef, Setup, Window};

fn nudged(setup: &Setup, gain: f64) -> Setup {
    let observer = ObserverDef { kind: "nudging".to_owned(), gain, ..ObserverDef::default() };
    Setup { observer, ..setup.clone() }
}

/// Every model that can host the observer as it is, with what a run of it needs.
fn hosts(observer: &str, gain: f64) -> Vec<(String, Setup, Vec<f64>)> {
    let of_kind = |kind: String| {
        let (setup, theta) = setup(&kind);
        let observer = ObserverDef { kind: observer.to_owned(), gain, ..ObserverDef::default() };
        let setup = Setup { observer, ..setup };
        setup.build().is_ok().then_some((kind, setup, theta))
    };
    kinds().into_iter().filter_map(of_kind).collect()
}

#[test]
fn on_noise_free_data_of_the_true_model_the_prediction_does_not_move_with_the_gain() {
    for observer in observer::kinds() {
        let hosts_of = |gain| hosts(observer.kind, gain);
        assert!(!hosts_of(0.1).is_empty(), "no model of the list hosts `{}`", observer.kind);
        for gain in [0.1, 10.0, 1e6] {
            for (kind, setup, theta) in hosts_of(gain) {
                let mut window = window(&setup, 40);
                let free = Setup { observer: ObserverDef::default(), ..setup.clone() };
                let truth = run(&*free.build().unwrap(), &window, &theta);
                window.observed.clone_from(&truth.outputs);
                // Bitwise: every innovation is exactly zero.
                let observed = run(&*setup.build().unwrap(), &window, &theta);
                assert_eq!(observed, truth, "{kind} with {}, gain {gain}", observer.kind);
            }
        }
    }
}

#[test]
fn a_prediction_is_recorded_before_the_same_times_datum_corrects_it() {
    let (setup, theta) = setup("windkessel-2");
    let mut window = window(&setup, 3);
    let free = run(&*setup.build().unwrap(), &window, &theta);
    window.observed = vec![f64::NAN, f64::NAN, 500.0];
    let pulled = run(&*nudged(&setup, 1e9).build().unwrap(), &window, &theta);
    assert_eq!(pulled.outputs, free.outputs);
    assert_eq!(pulled.state, [500.0]);
}

#[test]
fn a_wrong_initial_pressure_is_forgotten_at_the_rate_of_the_gain() {
    let (setup, theta) = setup("windkessel-3");
    let mut window = window(&setup, 50);
    window.observed = run(&*setup.build().unwrap(), &window, &theta).outputs;
    let final_error = |gain: f64| {
        let mut setup = nudged(&setup, gain);
        let truth = run(&*setup.build().unwrap(), &window, &theta).state;
        setup.model.constants.insert("initial:p".to_owned(), 120.0);
        run(&*setup.build().unwrap(), &window, &theta).state[0] - truth[0]
    };
    let (r, c, gain) = (theta[0], theta[1], 3.0);
    // Between corrections the error decays as exp(−t/RC), and each correction multiplies it by exp(−gain Δt).
    let want = 40.0 * (-(1.0 / (r * c) + gain)).exp();
    assert!((final_error(gain) - want).abs() < 1e-12 * 120.0, "{} against {want}", final_error(gain));
}

#[test]
fn an_observation_at_the_very_start_is_predicted_but_corrects_nothing() {
    let (setup, theta) = setup("oscillator");
    let window =
        Window { start: 0.0, times: vec![0.0], observed: vec![9.0, 9.0], inputs: vec![], since: vec![] };
    let prediction = run(&*nudged(&setup, 1e9).build().unwrap(), &window, &theta);
    assert_eq!(prediction.outputs, [1.0, 0.0]);
    assert_eq!(prediction.state, [1.0, 0.0]);
}

#[test]
fn a_gain_beyond_the_explicit_limit_stays_stable() {
    let (setup, theta) = setup("windkessel-2");
    let mut window = window(&setup, 40);
    let truth = run(&*setup.build().unwrap(), &window, &theta);
    window.observed.clone_from(&truth.outputs);
    let mut setup = nudged(&setup, 1e8);
    setup.model.constants.insert("initial:p".to_owned(), -500.0);
    let state = run(&*setup.build().unwrap(), &window, &theta).state;
    // The first correction takes the state to the data; what is left is rounding of 580 mmHg.
    assert!(largest_difference(&state, &truth.state) < 1e-12, "{state:?}");
}

/// Every model with a wall, with every observer of a wall that it can host.
fn walls() -> Vec<(Setup, Vec<f64>)> {
    let mut walls = Vec::new();
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let Some(blocks) = setup.model().unwrap().blocks(&theta) else { continue };
        let mut observers = vec!["dvf", "dvf-am", "sdf", "sdf-displacement", "image-force"];
        if blocks.windkessel.is_some() && blocks.outputs.pressure.is_some() {
            observers.push("windkessel");
        }
        for observer in observers {
            let observer = ObserverDef { kind: observer.to_owned(), gain: 3.0, ..ObserverDef::default() };
            walls.push((Setup { observer, ..setup.clone() }, theta.clone()));
        }
    }
    assert!(walls.len() >= 10, "both oscillators have a wall");
    walls
}

#[test]
fn a_wall_too_large_for_dense_matrices_is_refused_by_every_observer_that_needs_them() {
    for kind in ["dvf", "dvf-am", "sdf", "sdf-displacement", "image-force", "windkessel"] {
        let build = |cells: usize| {
            let layout = Some(serde_json::json!({ "cells": cells }));
            let model = ModelDef { kind: "fsi-tube".to_owned(), layout, ..ModelDef::default() };
            let observer = ObserverDef { kind: kind.to_owned(), gain: 1.0, ..ObserverDef::default() };
            let outputs = ["displacement", "velocity", "pressure"].map(str::to_owned).to_vec();
            let mut setup = Setup { model, observer, outputs, ..Setup::default() };
            let parameters = setup.model().unwrap().spec().parameters.clone();
            setup.parameters = parameters.into_iter().map(|q| q.name).collect();
            setup.build().err().map(|error| error.to_string())
        };
        let error = build(1001).unwrap();
        assert!(error.contains(&format!("`{kind}`")) && error.contains("at most 1000 nodes"), "{error}");
        assert!(error.contains("1001") && error.contains("`nudging`"), "{error}");
        assert_eq!(build(20), None, "{kind}");
    }
}

#[test]
fn every_model_with_a_wall_hosts_every_observer_of_a_wall_and_true_data_move_none() {
    for (setup, theta) in walls() {
        let what = format!("{} with {}", setup.model.kind, setup.observer.kind);
        let mut window = window(&setup, 6);
        let n_obs = setup.spec().unwrap().n_output();
        window.observed = vec![f64::NAN; 6 * n_obs];
        let model = setup.build().unwrap();
        let truth = run(&*model, &window, &theta);
        window.observed.clone_from(&truth.outputs);
        // Bitwise: every innovation is exactly zero.
        assert_eq!(run(&*model, &window, &theta), truth, "{what}");
        for (i, value) in window.observed.iter_mut().enumerate() {
            *value = if i % 7 == 3 { f64::NAN } else { *value + 0.01 * (i as f64).cos() };
        }
        let moved = run(&*model, &window, &theta);
        assert_ne!(moved.state, truth.state, "{what}");
        assert_eq!(run_in_pieces(&*model, &window, &theta, 2), moved, "{what}");
    }
}
