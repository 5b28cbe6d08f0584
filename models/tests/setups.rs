//! Wrong setups are refused with the name, the place and the nearest valid name.

mod common;

use common::setup;
use starlings_models::equations::{EquationsDef, OutputDef, StateDef};
use starlings_models::{BuildSetup, ModelDef, Setup, SetupError, Window};

fn refused(change: impl FnOnce(&mut Setup)) -> SetupError {
    let (mut setup, _) = setup("windkessel-3");
    setup.build().map(|_| ()).expect("the setup before the change");
    change(&mut setup);
    setup.build().map(|_| ()).expect_err("a wrong setup")
}

fn unknown(what: &'static str, name: &str, nearest: Option<&str>) -> SetupError {
    SetupError::Unknown { what, name: name.to_owned(), nearest: nearest.map(str::to_owned) }
}

#[test]
fn an_unknown_model_offers_the_nearest() {
    let error = refused(|s| s.model.kind = "windkesel-3".to_owned());
    assert_eq!(error, unknown("model", "windkesel-3", Some("windkessel-3")));
}

#[test]
fn an_unknown_parameter_offers_the_nearest_whatever_its_letter_case() {
    assert_eq!(refused(|s| s.parameters[2] = "ZC".to_owned()), unknown("parameter", "ZC", Some("Zc")));
    let error = refused(|s| s.parameters.push("intial:p".to_owned()));
    assert_eq!(error, unknown("parameter", "intial:p", Some("initial:p")));
}

#[test]
fn an_unknown_state_behind_initial_is_named_as_a_state() {
    let error = refused(|s| s.parameters.push("initial:temperature".to_owned()));
    assert_eq!(error, unknown("state", "temperature", None));
}

#[test]
fn an_unknown_output_constant_or_observer_is_refused() {
    assert_eq!(
        refused(|s| s.outputs[0] = "presure".to_owned()),
        unknown("output or scalar state", "presure", Some("pressure"))
    );
    let error = refused(|s| {
        s.model.constants.insert("L".to_owned(), 1.0);
    });
    assert_eq!(error, unknown("constant", "L", None));
    assert_eq!(
        refused(|s| s.observer.kind = "nuding".to_owned()),
        unknown("observer", "nuding", Some("nudging"))
    );
}

#[test]
fn a_parameter_without_value_is_missing() {
    let error = refused(|s| {
        s.parameters.pop();
    });
    assert_eq!(error, SetupError::Missing { model: "windkessel-3".to_owned(), name: "Zc".to_owned() });
}

#[test]
fn a_name_given_twice_is_refused() {
    assert_eq!(refused(|s| s.parameters.push("R".to_owned())), SetupError::Twice("R".to_owned()));
    assert_eq!(refused(|s| s.outputs.push("pressure".to_owned())), SetupError::Twice("pressure".to_owned()));
}

#[test]
fn a_parameter_that_is_also_a_constant_is_refused() {
    let error = refused(|s| {
        s.model.constants.insert("R".to_owned(), 1.0);
    });
    assert!(error.to_string().contains("both a constant and an estimated parameter"), "{error}");
}

#[test]
fn a_constant_outside_physics_is_refused() {
    let error = refused(|s| {
        s.parameters.remove(0);
        s.model.constants.insert("R".to_owned(), -1.0);
    });
    assert!(error.to_string().contains("`R` is -1, outside its range (> 0)"), "{error}");
    let error = refused(|s| {
        s.model.constants.insert("initial:p".to_owned(), f64::NAN);
    });
    assert!(error.to_string().contains("finite"), "{error}");
}

#[test]
fn a_constant_of_a_term_is_checked_like_any_other_and_hides_no_state() {
    use starlings_models::EffectDef;
    use starlings_models::effect::{Addition, EffectParameter};
    let with = |name: &str, value: f64| {
        refused(|s| {
            s.model.constants.insert("a".to_owned(), 0.0);
            s.effects.push(EffectDef {
                name: "offset".to_owned(),
                adds: vec![Addition { to: "pressure".to_owned(), term: "a*p*height".to_owned() }],
                parameters: vec![EffectParameter { name: "a".to_owned(), ..EffectParameter::default() }],
                ..EffectDef::default()
            });
            s.model.constants.insert("height".to_owned(), 1.0);
            s.model.constants.insert(name.to_owned(), value);
        })
    };
    assert!(with("height", f64::NAN).to_string().contains("give a finite number"));
    assert_eq!(with("p", 3.0), unknown("constant", "p", None));
}

#[test]
fn a_negative_gain_is_refused() {
    let error = refused(|s| s.observer.gain = -1.0);
    assert!(error.to_string().contains("gain is -1"), "{error}");
}

#[test]
fn equations_are_given_exactly_when_the_kind_says_so() {
    let error = refused(|s| s.model.kind = "equations".to_owned());
    assert!(error.to_string().contains("needs its states"), "{error}");
    let error = refused(|s| s.model.equations = Some(EquationsDef::default()));
    assert!(error.to_string().contains("has its own equations"), "{error}");
}

#[test]
fn equations_have_no_layout() {
    let rate = vec![("x".to_owned(), "-x".to_owned())];
    let state = StateDef { name: "x".to_owned(), initial: "1".to_owned(), rate, ..StateDef::default() };
    let equations = EquationsDef { states: vec![state], ..EquationsDef::default() };
    let mut model =
        ModelDef { kind: "equations".to_owned(), equations: Some(equations), ..ModelDef::default() };
    let build = |model: &ModelDef| Setup { model: model.clone(), ..Setup::default() }.model().map(|_| ());
    assert_eq!(build(&model), Ok(()));
    model.layout = Some(serde_json::json!({ "cells": 3 }));
    let error = build(&model).expect_err("a layout");
    assert!(error.to_string().contains("model `equations` has no layout"), "{error}");
}

#[test]
fn an_output_that_is_no_number_fails_the_runs_that_record_it_and_no_others() {
    let state = StateDef {
        name: "x".to_owned(),
        initial: "1".to_owned(),
        rate: vec![("x".to_owned(), "-x".to_owned())],
        ..StateDef::default()
    };
    let output = |name: &str, value: &str| OutputDef {
        name: name.to_owned(),
        value: value.to_owned(),
        ..OutputDef::default()
    };
    let outputs = vec![output("level", "x"), output("lost", "log(x - 2)")];
    let equations = EquationsDef { states: vec![state], outputs, ..EquationsDef::default() };
    let model = ModelDef { kind: "equations".to_owned(), equations: Some(equations), ..ModelDef::default() };
    let ran = |output: &str| {
        let setup = Setup { model: model.clone(), outputs: vec![output.to_owned()], ..Setup::default() };
        let window = Window::free(0.0, vec![0.0, 1.0], 1, Vec::new());
        setup.build().unwrap().run(&common::job(&window, &[])).map_err(|error| error.to_string())
    };
    assert_eq!(ran("lost").unwrap_err(), "output `lost` is not a finite number at t = 0");
    assert!(ran("level").is_ok_and(|prediction| prediction.outputs[0] > 0.9));
}

#[test]
fn a_setup_survives_json() {
    let (mut setup, _) = setup("windkessel-2");
    setup.effects = starlings_models::effect::library(&setup.spec().unwrap());
    let text = serde_json::to_string(&setup).unwrap();
    assert_eq!(serde_json::from_str::<Setup>(&text).unwrap(), setup, "{text}");
}
