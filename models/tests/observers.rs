//! Observers inside a run: what they may move and what they may not.
#![allow(clippy::float_cmp)]

mod common;

use common::{kinds, largest_difference, run, setup, window};
use starlings_models::{ObserverDef, Setup, Window};

fn nudged(setup: &Setup, gain: f64) -> Setup {
    let observer = ObserverDef { kind: "nudging".to_owned(), gain, ..ObserverDef::default() };
    Setup { observer, ..setup.clone() }
}

#[test]
fn on_noise_free_data_of_the_true_model_the_prediction_does_not_move_with_the_gain() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let mut window = window(&setup, 40);
        let truth = run(&*setup.build().unwrap(), &window, &theta);
        window.observed.clone_from(&truth.outputs);
        for gain in [0.1, 10.0, 1e6] {
            // Bitwise: every innovation is exactly zero.
            assert_eq!(
                run(&*nudged(&setup, gain).build().unwrap(), &window, &theta),
                truth,
                "{kind}, gain {gain}"
            );
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
    let window = Window { start: 0.0, times: vec![0.0], observed: vec![9.0, 9.0], inputs: vec![] };
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
