//! Scalar states recorded beside outputs: as they are before any correction, and never measured.
#![allow(clippy::float_cmp)]

mod common;

use common::{job, run, setup, window};
use starlings_models::{BuildSetup, Job, Setup, Window};

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// The window with these values of its rows observed at every time.
fn observing(window: &Window, row: &[f64]) -> Window {
    Window { observed: row.repeat(window.times.len()), ..window.clone() }
}

#[test]
fn a_state_is_recorded_where_no_output_has_its_name() {
    let (plain, theta) = setup("windkessel-3");
    let both = Setup { outputs: names(&["p", "pressure"]), ..plain.clone() };
    let inputs = window(&plain, 12);
    let theirs = run(&*plain.build().unwrap(), &inputs, &theta);
    let window = observing(&inputs, &[f64::NAN; 2]);
    let got = run(&*both.build().unwrap(), &window, &theta);
    let rows = |row: usize| got.outputs.iter().skip(row).step_by(2).copied().collect::<Vec<_>>();
    assert_eq!(rows(1), theirs.outputs);
    assert_eq!(rows(0).last(), got.state.first(), "the last record is the state at the end");
    assert_ne!(rows(0), rows(1), "the pressure at the inlet is another one");
}

#[test]
fn an_observer_takes_no_recorded_state_for_measured() {
    let (mut setup, theta) = setup("oscillator");
    setup.observer.kind = "nudging".to_owned();
    setup.observer.gain = 3.0;
    let with = |outputs: &[&str]| Setup { outputs: names(outputs), ..setup.clone() };
    let plain = window(&with(&["position"]), 15);
    let run = |outputs: &[&str], row: &[f64]| {
        let window = observing(&plain, row);
        with(outputs).build().unwrap().run(&Job { ..job(&window, &theta) }).unwrap()
    };
    let alone = run(&["position"], &[2.0]);
    // The value given for the state is nobody's measurement: it moves nothing.
    let beside = run(&["v", "position"], &[1e6, 2.0]);
    assert_eq!(beside.state, alone.state);
    let rows = |row: usize| beside.outputs.iter().skip(row).step_by(2).copied().collect::<Vec<_>>();
    assert_eq!(rows(1), alone.outputs);
    // An output that shows the same state, not observed, says what it was before the correction.
    let shown = run(&["velocity", "position"], &[f64::NAN, 2.0]);
    assert_eq!(shown.outputs, beside.outputs);
}

#[test]
fn a_recorded_state_in_front_of_a_wall_moves_no_row_of_its_observer() {
    let (mut setup, theta) = setup("fsi-tube");
    setup.observer.kind = "sdf".to_owned();
    setup.observer.gain = 5.0;
    let spec = setup.spec().unwrap();
    let (displacement, component) = ("displacement".to_owned(), "eta[0]".to_owned());
    assert!(spec.outputs.iter().all(|q| q.name != "eta"), "else it were an output");
    let alone = Setup { outputs: vec![displacement.clone()], ..setup.clone() };
    let inputs = window(&alone, 6);
    let n = inputs.observed.len() / 6;
    let first = alone.build().unwrap().run(&job(&observing(&inputs, &vec![0.01; n]), &theta)).unwrap();
    let beside = Setup { outputs: vec![component, displacement], ..setup };
    let row = [vec![1e6], vec![0.01; n]].concat();
    let second = beside.build().unwrap().run(&job(&observing(&inputs, &row), &theta)).unwrap();
    assert_eq!(second.state, first.state);
}

#[test]
fn a_name_of_neither_offers_the_nearest_and_a_field_of_states_is_none() {
    let (plain, _) = setup("oscillator");
    let error = |name: &str, plain: &Setup| {
        let setup = Setup { outputs: names(&[name]), ..plain.clone() };
        setup.build().map(|_| ()).expect_err("no such row").to_string()
    };
    let text = error("positon", &plain);
    assert!(text.contains("no output or scalar state named") && text.contains("`position`"), "{text}");
    let (wall, _) = setup("fsi-tube");
    let field = wall.spec().unwrap().states[0].clone();
    assert!(field.size > 1);
    assert!(error(&field.name, &wall).contains("no output or scalar state"), "one row shows one number");
}
