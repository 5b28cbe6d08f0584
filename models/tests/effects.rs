//! Effects inside a run: absent at zero, exact where an exact answer is known, refused where they do not fit.
#![allow(clippy::float_cmp)]

mod common;

use common::{kinds, largest_difference, run, run_in_pieces, setup, window};
use starlings_models::effect::{Addition, EffectParameter, EffectState};
use starlings_models::equations::{EquationsDef, InputDef, OutputDef, StateDef};
use starlings_models::{BuildSetup, EffectDef, ModelDef, Quantity, Setup, SetupError, Signal};

fn effect(name: &str, adds: &[(&str, &str)], parameters: &[&str]) -> EffectDef {
    let add = |(to, term): &(&str, &str)| Addition { to: (*to).to_owned(), term: (*term).to_owned() };
    let parameter = |name: &&str| EffectParameter { name: (*name).to_owned(), ..EffectParameter::default() };
    EffectDef {
        name: name.to_owned(),
        adds: adds.iter().map(add).collect(),
        parameters: parameters.iter().map(parameter).collect(),
        ..EffectDef::default()
    }
}

/// The setup with this effect and its parameters fixed.
fn with(setup: &Setup, effect: EffectDef, values: &[f64]) -> Setup {
    let mut setup = setup.clone();
    for (parameter, &value) in effect.parameters.iter().zip(values) {
        setup.model.constants.insert(parameter.name.clone(), value);
    }
    setup.effects.push(effect);
    setup
}

fn refused(setup: &Setup) -> SetupError {
    setup.build().map(|_| ()).expect_err("a wrong effect")
}

#[test]
fn two_elements_with_a_series_resistance_are_three() {
    let (two, theta) = setup("windkessel-2");
    let (three, _) = setup("windkessel-3");
    let built_in = EffectDef { built_in: Some("series-resistance".to_owned()), ..EffectDef::default() };
    let mut two = Setup { effects: vec![built_in], ..two };
    two.parameters.push("Rs".to_owned());
    let theta = [theta[0], theta[1], 0.09];
    let window = window(&two, 40);
    let extended = run(&*two.build().unwrap(), &window, &theta);
    let native = run(&*three.build().unwrap(), &window, &theta);
    // The same sums and products in the same order, of values near 100.
    assert!(largest_difference(&extended.outputs, &native.outputs) < 1e-12);
    assert_eq!(extended.state, native.state);
}

/// The first quantity that a term can be added to.
fn scalar(list: &[Quantity]) -> Option<&str> {
    list.iter().find(|q| q.size == 1).map(|q| q.name.as_str())
}

#[test]
fn at_amplitude_zero_an_effect_on_outputs_changes_no_bit_of_any_model() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let window = window(&setup, 30);
        let spec = setup.spec().unwrap();
        let (Some(output), Some(state)) = (scalar(&spec.outputs), scalar(&spec.states)) else { continue };
        let term = format!("a*{state}^2");
        let extended = with(&setup, effect("bent sensor", &[(output, &term)], &["a"]), &[]);
        let plain = run(&*setup.build().unwrap(), &window, &theta);
        assert_eq!(run(&*extended.build().unwrap(), &window, &theta), plain, "{kind}");
        let bent = with(&setup, extended.effects[0].clone(), &[0.1]);
        assert_ne!(run(&*bent.build().unwrap(), &window, &theta).outputs, plain.outputs, "{kind}");
    }
}

#[test]
fn at_amplitude_zero_an_effect_on_rates_and_inputs_is_absent() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let window = window(&setup, 30);
        let spec = setup.spec().unwrap();
        // With an effect the rate is integrated: a scheme of an order of its own is another solution.
        let Some(state) =
            scalar(&spec.states).filter(|_| !["fsi-tube", "artery-1d"].contains(&kind.as_str()))
        else {
            continue;
        };
        let term = format!("a*{state}*abs({state})");
        let mut adds = vec![(state, term.as_str())];
        if let Some(input) = spec.inputs.first() {
            adds.push((input.name.as_str(), term.as_str()));
        }
        let extended = with(&setup, effect("drag", &adds, &["a"]), &[0.0]);
        let plain = run(&*setup.build().unwrap(), &window, &theta);
        let got = run(&*extended.build().unwrap(), &window, &theta);
        // Integrated to 1e-8 per step instead of exact; a thousand of such errors relative to the largest value.
        let scale = plain.outputs.iter().fold(1.0_f64, |largest, value| largest.max(value.abs()));
        assert!(largest_difference(&got.outputs, &plain.outputs) < 1e-7 * scale, "{kind}");
        let pieces = run_in_pieces(&*extended.build().unwrap(), &window, &theta, 7);
        assert_eq!(pieces, got, "{kind} in pieces");
    }
}

#[test]
fn a_leak_on_the_rate_is_a_second_resistance_in_parallel() {
    let (setup, _) = setup("windkessel-2");
    let window = window(&setup, 30);
    let leaky = with(&setup, effect("leak", &[("p", "-g*p/C")], &["g"]), &[0.5]);
    let got = run(&*leaky.build().unwrap(), &window, &[2.0, 1.3]).outputs;
    // 1/2 + 0.5 = 1/1.
    let want = run(&*setup.build().unwrap(), &window, &[1.0, 1.3]).outputs;
    // The integrator's tolerance, 1e-8 per step of values near 80.
    assert!(largest_difference(&got, &want) < 1e-5, "{:e}", largest_difference(&got, &want));
}

#[test]
fn a_leak_on_the_input_is_the_same_leak() {
    let (setup, _) = setup("windkessel-2");
    let window = window(&setup, 30);
    let leaky = with(&setup, effect("leak", &[("flow", "-g*p")], &["g"]), &[0.5]);
    let got = run(&*leaky.build().unwrap(), &window, &[2.0, 1.3]).outputs;
    let want = run(&*setup.build().unwrap(), &window, &[1.0, 1.3]).outputs;
    assert!(largest_difference(&got, &want) < 1e-5, "{:e}", largest_difference(&got, &want));
}

#[test]
fn a_term_on_an_input_also_moves_its_slope() {
    let clock = StateDef {
        name: "x".to_owned(),
        initial: "0".to_owned(),
        rate: vec![("x".to_owned(), "2".to_owned())],
        ..StateDef::default()
    };
    let slope = OutputDef { name: "slope".to_owned(), value: "ddt(u)".to_owned(), ..OutputDef::default() };
    let equations = EquationsDef {
        states: vec![clock],
        outputs: vec![slope],
        inputs: vec![InputDef { name: "u".to_owned(), ..InputDef::default() }],
        ..EquationsDef::default()
    };
    let model = ModelDef { kind: "equations".to_owned(), equations: Some(equations), ..ModelDef::default() };
    let setup = Setup { model, outputs: vec!["slope".to_owned()], ..Setup::default() };
    let setup = with(&setup, effect("drift", &[("u", "a*x + a*t*t")], &["a"]), &[3.0]);
    let mut window = window(&setup, 4);
    window.inputs[0] = Signal { times: vec![0.0, 10.0], values: vec![0.0, 50.0] };
    let got = run(&*setup.build().unwrap(), &window, &[]).outputs;
    // du/dt = 5 + 3·2 + 3·2t, exact but for a few roundings.
    let want: Vec<f64> = window.times.iter().map(|t| 11.0 + 6.0 * t).collect();
    assert!(largest_difference(&got, &want) < 1e-13, "{got:?}");
}

#[test]
fn a_sensor_with_a_lag_brings_its_own_state() {
    let (mut setup, _) = setup("windkessel-2");
    setup.model.constants.insert("initial:p".to_owned(), 100.0);
    let mut lag = effect("sensor lag", &[("pressure", "a*(held - p)")], &["a", "lag", "start"]);
    lag.states = vec![EffectState {
        name: "held".into(),
        initial: "start".into(),
        rate: "(pressure - held)/lag".into(),
        ..EffectState::default()
    }];
    let setup = with(&setup, lag, &[1.0, 0.25, 60.0]);
    let mut window = window(&setup, 20);
    window.inputs[0].values.fill(0.0);
    let got = run(&*setup.build().unwrap(), &window, &[1.0, 2.0]);
    // p = 100 e^(−t/τ), τ = 2, and held = 60 e^(−t/l) + 100 (e^(−t/τ) − e^(−t/l))/(1 − l/τ), l = 0.25.
    let held = |t: f64| {
        let (slow, fast) = ((-t / 2.0).exp(), (-t / 0.25).exp());
        60.0 * fast + 100.0 * (slow - fast) / (1.0 - 0.25 / 2.0)
    };
    let want: Vec<f64> = window.times.iter().map(|&t| held(t)).collect();
    assert!(largest_difference(&got.outputs, &want) < 1e-5, "{:e}", largest_difference(&got.outputs, &want));
    assert_eq!(got.state.len(), 2);
}

#[test]
fn a_lag_far_shorter_than_the_run_is_followed() {
    let (mut setup, theta) = setup("windkessel-2");
    setup.model.constants.insert("initial:p".to_owned(), 100.0);
    let mut lag = effect("sensor lag", &[("pressure", "a*(held - p)")], &["a", "lag"]);
    lag.states =
        vec![EffectState { name: "held".into(), rate: "(p - held)/lag".into(), ..EffectState::default() }];
    let window = window(&setup, 5);
    let plain = run(&*setup.build().unwrap(), &window, &theta).outputs;
    // An explicit method alone would need a billion steps.
    let setup = with(&setup, lag, &[1.0, 1e-9]);
    let got = run(&*setup.build().unwrap(), &window, &theta).outputs;
    // The lag itself, 1e-9 of a slope near 100, and the tolerance of 1e-8 per step of values near 100.
    assert!(largest_difference(&got, &plain) < 2e-5, "{:e}", largest_difference(&got, &plain));
}

#[test]
fn a_threshold_inside_a_term_switches_where_it_should() {
    let (mut setup, _) = setup("windkessel-2");
    setup.model.constants.insert("initial:p".to_owned(), 100.0);
    // Above 50 a constant outflow: dp/dt = −a until p reaches 50, with R immense; then p stays.
    let spill = effect("spill", &[("p", "-a*step(p - 50)")], &["a"]);
    let setup = with(&setup, spill, &[200.0]);
    let mut window = window(&setup, 3);
    window.inputs[0].values.fill(0.0);
    let got = run(&*setup.build().unwrap(), &window, &[1e12, 1.0]).outputs;
    assert!(largest_difference(&got, &[100.0 - 200.0 / 3.0 + 50.0 / 3.0, 50.0, 50.0]) < 1e-6, "{got:?}");
}

#[test]
fn a_constant_that_only_a_term_uses_is_allowed() {
    let (setup, theta) = setup("windkessel-2");
    let window = window(&setup, 10);
    let mut offset = with(&setup, effect("offset", &[("pressure", "a*height")], &["a"]), &[2.0]);
    assert!(refused(&offset).to_string().contains("unknown name `height`"), "{}", refused(&offset));
    offset.model.constants.insert("height".to_owned(), 3.0);
    let got = run(&*offset.build().unwrap(), &window, &theta).outputs;
    let want: Vec<f64> =
        run(&*setup.build().unwrap(), &window, &theta).outputs.iter().map(|p| p + 6.0).collect();
    assert_eq!(got, want);
}

#[test]
fn an_effect_that_does_not_fit_is_refused_with_its_place() {
    let (setup, _) = setup("windkessel-2");
    let to = with(&setup, effect("a", &[("presure", "a*p")], &["a"]), &[]);
    assert!(refused(&to).to_string().contains("did you mean `pressure`"), "{}", refused(&to));
    let term = with(&setup, effect("a", &[("pressure", "a*flw")], &["a"]), &[]);
    match refused(&term) {
        SetupError::Expression { column, message, .. } => {
            assert_eq!(column, 3);
            assert!(message.contains("did you mean `flow`"), "{message}");
        }
        other => panic!("{other}"),
    }
    let output_to_input = with(&setup, effect("a", &[("flow", "a*pressure")], &["a"]), &[]);
    assert!(matches!(refused(&output_to_input), SetupError::Expression { .. }));
    let taken = with(&setup, effect("a", &[("p", "R*p")], &["R"]), &[]);
    assert_eq!(refused(&taken), SetupError::Twice("R".to_owned()));
    let unused = with(&setup, effect("a", &[("p", "a*p")], &["a", "b"]), &[]);
    assert!(
        refused(&unused).to_string().contains("`b` of effect `a` stands in none"),
        "{}",
        refused(&unused)
    );
    let time = with(&setup, effect("a", &[("p", "t*p")], &["t"]), &[]);
    assert!(
        refused(&time).to_string().contains("`t` cannot be the name of a parameter"),
        "{}",
        refused(&time)
    );
    let mut backwards = effect("a", &[("p", "a*p")], &["a"]);
    backwards.parameters[0].range = [1.0, 0.0];
    assert!(refused(&with(&setup, backwards, &[])).to_string().contains("give the smallest value first"));
    let unnamed = with(&setup, effect("", &[("p", "a*p")], &["a"]), &[]);
    assert_eq!(refused(&unnamed).to_string(), "an effect needs a name");
    let none = with(&setup, effect("a", &[], &["a"]), &[]);
    assert!(refused(&none).to_string().contains("needs at least one term"));
    let twice = with(
        &with(&setup, effect("a", &[("p", "a*p")], &["a"]), &[]),
        effect("a", &[("p", "b*p")], &["b"]),
        &[],
    );
    assert_eq!(refused(&twice), SetupError::Twice("a".to_owned()));
}

#[test]
fn a_second_parameter_defaults_to_the_middle_of_its_grid_or_is_required() {
    let (setup, theta) = setup("windkessel-2");
    let mut spill = effect("spill", &[("pressure", "a*max(p - rim, 0)")], &["a", "rim"]);
    let missing = Setup { effects: vec![spill.clone()], ..setup.clone() };
    assert_eq!(
        refused(&missing),
        SetupError::Missing { model: "windkessel-2".to_owned(), name: "rim".to_owned() }
    );
    spill.parameters[1].grid = vec![20.0, 30.0, 70.0];
    let window = window(&setup, 10);
    let by_default = with(&setup, spill.clone(), &[0.5]);
    let by_value = with(&setup, spill, &[0.5, 30.0]);
    let got = run(&*by_default.build().unwrap(), &window, &theta);
    assert_eq!(got, run(&*by_value.build().unwrap(), &window, &theta));
    assert_ne!(got, run(&*setup.build().unwrap(), &window, &theta));
}
