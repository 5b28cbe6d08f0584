//! Every kind of built-in effect against the equations written out by hand: the sign, the operator and the place of each term.
//!
//! A limit, a play or a rounding is written in another way here than in the library where there is another way.
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod library_kit;
#[path = "library_terms/table.rs"]
mod table;

use std::collections::BTreeSet;

use library_kit::{Bench, benches};
use starlings_models::effect::library::{FAMILIES, Family, library, stem};
use starlings_models::equations::StateDef;
use starlings_models::{BuildSetup, EffectDef, Setup};
use table::{Case, Hand, TABLE};

fn effect(bench: &Bench, name: &str) -> EffectDef {
    let found = library(&bench.spec).into_iter().find(|effect| effect.name == name);
    found.unwrap_or_else(|| panic!("{} hosts no {name}", bench.name))
}

/// The model with the built-in effect, every number of it given in the model's units.
fn extended(bench: &Bench, case: &Case) -> Setup {
    let effect = effect(bench, case.effect);
    assert_eq!(effect.parameters.len(), case.values.len(), "{}: {:?}", case.effect, effect.parameters);
    let mut setup = bench.setup.clone();
    let values = effect.parameters.iter().zip(case.values);
    setup.model.constants.extend(values.map(|(parameter, value)| (parameter.name.clone(), *value)));
    setup.effects.push(effect);
    setup
}

/// A text with a whole name replaced.
fn replaced(text: &str, name: &str, by: &str) -> String {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let mut result = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(word) {
        let end = rest[start..].find(|c| !word(c)).map_or(rest.len(), |n| start + n);
        result.push_str(&rest[..start]);
        result.push_str(if &rest[start..end] == name { by } else { &rest[start..end] });
        rest = &rest[end..];
    }
    result + rest
}

/// The model with the effect in its equations, or with its parameter moved.
fn written(bench: &Bench, hand: &[Hand]) -> (Setup, Vec<f64>) {
    let (mut setup, mut theta) = (bench.setup.clone(), bench.theta.clone());
    for change in hand {
        if let Hand::Plus(name, value) = change {
            let at = setup.parameters.iter().position(|p| p == name).unwrap();
            theta[at] += value;
            continue;
        }
        let equations = setup.model.equations.as_mut().unwrap();
        match *change {
            Hand::Rate(state, term) => {
                let state = equations.states.iter_mut().find(|s| s.name == state).unwrap();
                state.rate.push(("by_hand".to_owned(), term.to_owned()));
            }
            Hand::State(name, initial, rate) => equations.states.push(StateDef {
                name: name.to_owned(),
                initial: initial.to_owned(),
                rate: vec![(name.to_owned(), rate.to_owned())],
                ..StateDef::default()
            }),
            Hand::Output(name, value) => {
                let output = equations.outputs.iter_mut().find(|o| o.name == name).unwrap();
                value.clone_into(&mut output.value);
            }
            Hand::Instead(name, by) => {
                let rates = equations.states.iter_mut().flat_map(|s| &mut s.rate).map(|(_, text)| text);
                for text in rates.chain(equations.outputs.iter_mut().map(|o| &mut o.value)) {
                    *text = replaced(text, name, by);
                }
            }
            Hand::Plus(..) => {}
        }
    }
    (setup, theta)
}

/// The state in which the plain model starts.
fn start(bench: &Bench) -> Vec<f64> {
    let model = bench.setup.model().unwrap();
    let mut x = vec![0.0; model.spec().n_state()];
    model.initial(&bench.theta, &mut x);
    x
}

#[test]
fn every_kind_of_effect_is_what_its_equations_say() {
    let benches = benches();
    let mut faults = Vec::new();
    for case in TABLE {
        let bench = benches.iter().find(|bench| bench.name == case.bench).unwrap();
        let (setup, theta) = written(bench, case.hand);
        // Where a run with an effect starts follows from the plain parameters.
        let moved = case.hand.iter().any(|change| matches!(change, Hand::Plus(..)));
        let start = moved.then(|| start(bench));
        let want = bench.run_from(&setup, &theta, start.clone()).unwrap();
        let with = match bench.run_from(&extended(bench, case), &bench.theta, start) {
            Ok(with) => with,
            Err(error) => {
                faults.push(format!("{} in {}: {error}", case.effect, case.bench));
                continue;
            }
        };
        let plain = bench.run(&[], 0.0).unwrap();
        // Both are integrated, to a relative tolerance of 1e-8 per step; a scheme of a model's own is kept by both.
        let (error, size) = (bench.difference(&want, &with), bench.difference(&plain, &want));
        if error > 1e-6 || size < 1e-3 {
            faults.push(format!("{} in {}: off by {error:e}, of {size:e}", case.effect, case.bench));
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn a_sensor_that_rounds_shows_the_rounded_value_but_for_the_higher_harmonics() {
    let bench = benches().into_iter().find(|bench| bench.name == "ramp").unwrap();
    let step = 0.5;
    let case = Case { bench: "ramp", effect: "sensor-quantisation", values: &[1.0, 0.5], hand: &[] };
    let got = bench.run_from(&extended(&bench, &case), &bench.theta, None).unwrap();
    let mut told = 0;
    // The rows are the output and the state.
    for (t, value) in bench.window.times.iter().zip(got.iter().step_by(2)) {
        let y = (8.0 * t).sin();
        let rounded = step * (y / step).round();
        let part = ((y - rounded) / step).abs();
        if part > 0.35 {
            continue; // where it jumps, three harmonics do not follow
        }
        // The harmonics from the fourth on alternate: they sum to at most 1/(2 pi 4 cos(pi part)) < 0.09 steps.
        assert!((value - rounded).abs() < 0.09 * step, "{t}: {value} instead of {rounded} for {y}");
        told += usize::from(part > 0.15);
    }
    // Not rounding at all would show here.
    assert!(told >= 2, "{told}");
}

#[test]
fn the_table_has_every_kind_of_effect() {
    let told: BTreeSet<&str> = TABLE.iter().map(|case| stem(case.effect)).collect();
    // Found in closed form: here, and among the places of the library.
    let elsewhere = ["sensor-quantisation", "sensor-lag"];
    let catalogue: Vec<EffectDef> = FAMILIES.iter().flat_map(Family::catalogue).collect();
    let missing: Vec<&str> = catalogue
        .iter()
        .map(|effect| stem(&effect.name))
        .filter(|kind| !told.contains(kind) && !elsewhere.contains(kind))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}
