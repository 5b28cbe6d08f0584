//! Effects that shift a parameter of the model during a run: as if the model had been written with them.
#![allow(clippy::float_cmp)]

mod common;

use std::time::Duration;

use common::{job, kinds, largest_difference, run, run_in_pieces, setup, window};
use starlings_models::equations::{EquationsDef, InputDef, OutputDef, StateDef};
use starlings_models::{
    Addition, BuildSetup, EffectDef, EffectParameter, Job, ModelDef, ModelFailure, ParticleError, Setup,
    SetupError, Window,
};

fn effect(adds: &[(&str, &str)], parameters: &[&str]) -> EffectDef {
    let add = |(to, term): &(&str, &str)| Addition { to: (*to).to_owned(), term: (*term).to_owned() };
    let parameter = |name: &&str| EffectParameter { name: (*name).to_owned(), ..EffectParameter::default() };
    EffectDef {
        name: "shift".to_owned(),
        adds: adds.iter().map(add).collect(),
        parameters: parameters.iter().map(parameter).collect(),
        ..EffectDef::default()
    }
}

/// The setup with this effect, whose parameters are `a`, `b`, ... with these values.
fn with(setup: &Setup, adds: &[(&str, &str)], values: &[f64]) -> Setup {
    let names = &["a", "b"][..values.len()];
    let mut setup = setup.clone();
    setup.model.constants.extend(names.iter().zip(values).map(|(n, v)| ((*n).to_owned(), *v)));
    setup.effects.push(effect(adds, names));
    setup
}

fn refused(setup: &Setup) -> SetupError {
    setup.build().map(|_| ()).expect_err("a wrong effect")
}

fn equations(rate: &str, outputs: &[(&str, &str)], constants: &[(&str, f64)]) -> Setup {
    let state = StateDef {
        name: "p".to_owned(),
        initial: "1".to_owned(),
        rate: vec![("p".to_owned(), rate.to_owned())],
        ..StateDef::default()
    };
    let output = |(name, value): &(&str, &str)| OutputDef {
        name: (*name).to_owned(),
        value: (*value).to_owned(),
        ..OutputDef::default()
    };
    let equations = EquationsDef {
        states: vec![state],
        outputs: outputs.iter().map(output).collect(),
        inputs: vec![InputDef { name: "flow".to_owned(), ..InputDef::default() }],
        ..EquationsDef::default()
    };
    let constants = constants.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let model = ModelDef {
        kind: "equations".to_owned(),
        equations: Some(equations),
        constants,
        ..ModelDef::default()
    };
    Setup { model, outputs: outputs.iter().map(|(name, _)| (*name).to_owned()).collect(), ..Setup::default() }
}

/// A combustion chamber: its pressure, and the thrust that goes with it.
fn chamber(throat: &str, constants: &[(&str, f64)]) -> Setup {
    let rate = format!("20*(3*max(p, 0)^0.3 - {throat}*p)");
    let thrust = format!("1.4*{throat}*p");
    equations(&rate, &[("pressure", "p"), ("thrust", &thrust)], constants)
}

#[test]
fn a_throat_that_widens_in_a_step_is_the_chamber_written_with_the_step() {
    let plain = chamber("throat", &[("throat", 1.0)]);
    let extended = with(&plain, &[("throat", "a*step(t - b)")], &[0.4, 0.437]);
    let constants = [("throat", 1.0), ("a", 0.4), ("b", 0.437)];
    let written = chamber("(throat + a*step(t - b))", &constants);
    let window = window(&extended, 40);
    let got = run(&*extended.build().unwrap(), &window, &[]);
    let want = run(&*written.build().unwrap(), &window, &[]);
    // The same sums and products, in steps that may differ by how the switch is located; values near 5.
    assert!(largest_difference(&got.outputs, &want.outputs) < 1e-9);
    let unmoved = run(&*plain.build().unwrap(), &window, &[]);
    // Before the step nothing differs, after it the thrust does at once.
    assert!(largest_difference(&got.outputs[..2 * 17], &unmoved.outputs[..2 * 17]) < 1e-9);
    assert!(largest_difference(&got.outputs[2 * 17..2 * 18], &unmoved.outputs[2 * 17..2 * 18]) > 0.5);
    let pieces = run_in_pieces(&*extended.build().unwrap(), &window, &[], 7);
    assert!(largest_difference(&pieces.outputs, &got.outputs) < 1e-9, "a run in pieces restarts its steps");
}

#[test]
fn a_compliance_that_grows_with_pressure_is_the_windkessel_written_with_it() {
    let (native, theta) = setup("windkessel-2");
    let extended = with(&native, &[("C", "a*p")], &[0.004]);
    let mut written = equations(
        "(flow - p/R)/(C + a*p)",
        &[("pressure", "p")],
        &[("R", theta[0]), ("C", theta[1]), ("a", 0.004)],
    );
    written.model.constants.insert("initial:p".to_owned(), 80.0);
    let window = window(&extended, 30);
    let got = run(&*extended.build().unwrap(), &window, &theta).outputs;
    let want = run(&*written.build().unwrap(), &window, &[]).outputs;
    // Two integrations to 1e-8 per step of values near 80.
    assert!(largest_difference(&got, &want) < 1e-5, "{:e}", largest_difference(&got, &want));
    let plain = run(&*native.build().unwrap(), &window, &theta).outputs;
    assert!(largest_difference(&got, &plain) > 0.1, "it acts");
}

#[test]
fn a_shift_that_does_not_change_during_a_run_gives_the_bits_of_the_shifted_parameter() {
    for kind in kinds() {
        let (setup, theta) = setup(&kind);
        let model = setup.model().unwrap();
        let Some(at) = theta.iter().position(|value| *value > 0.0) else { continue };
        let name = &setup.parameters[at];
        let extended = with(&setup, &[(name, &format!("a*{name}"))], &[1e-3]);
        let window = window(&setup, 20);
        let mut x = vec![0.0; model.spec().n_state()];
        model.initial(&theta, &mut x);
        // Where a run starts follows from the plain parameter, so both start there.
        let from = |theta: &[f64]| Job { state: Some(x.clone().into()), ..job(&window, theta) };
        let mut shifted = theta.clone();
        shifted[at] += 1e-3 * shifted[at];
        let got = extended.build().unwrap().run(&from(&theta)).unwrap();
        let want = setup.build().unwrap().run(&from(&shifted)).unwrap();
        assert_eq!(got, want, "{kind}");
        let plain = setup.build().unwrap().run(&from(&theta)).unwrap();
        assert_ne!(got, plain, "{kind}: `{name}` matters");
    }
}

#[test]
fn at_amplitude_zero_a_shift_is_absent() {
    let (native, theta) = setup("windkessel-3");
    let window = window(&native, 20);
    let plain = run(&*native.build().unwrap(), &window, &theta);
    let still = with(&native, &[("C", "a*b")], &[0.0, 3.0]);
    assert_eq!(run(&*still.build().unwrap(), &window, &theta), plain);
    let moving = with(&native, &[("C", "a*p*t")], &[0.0]);
    let got = run(&*moving.build().unwrap(), &window, &theta);
    // Integrated to 1e-8 per step instead of exact, values near 80.
    assert!(largest_difference(&got.outputs, &plain.outputs) < 1e-5);
}

#[test]
fn two_shifts_of_one_parameter_add_up_and_go_with_terms_elsewhere() {
    let plain = chamber("throat", &[("throat", 1.0)]);
    let adds = [("throat", "a*t"), ("throat", "b*p"), ("thrust", "a*p")];
    let extended = with(&plain, &adds, &[0.3, 0.02]);
    let written = {
        let throat = "(throat + a*t + b*p)";
        let rate = format!("20*(3*max(p, 0)^0.3 - {throat}*p)");
        let thrust = format!("1.4*{throat}*p + a*p");
        let constants = [("throat", 1.0), ("a", 0.3), ("b", 0.02)];
        equations(&rate, &[("pressure", "p"), ("thrust", &thrust)], &constants)
    };
    let window = window(&extended, 20);
    let got = run(&*extended.build().unwrap(), &window, &[]).outputs;
    let want = run(&*written.build().unwrap(), &window, &[]).outputs;
    // The same arithmetic but for the order of a sum, through steps controlled to 1e-8.
    assert!(largest_difference(&got, &want) < 1e-9, "{:e}", largest_difference(&got, &want));
}

#[test]
#[expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a run that does not end is told by a clock"
)]
fn a_parameter_driven_out_of_its_range_fails_the_run_and_ends() {
    let started = std::time::Instant::now();
    let (native, theta) = setup("windkessel-2");
    let failure = |term: &str, flow: f64, start: f64| {
        let mut setup = with(&native, &[("C", term)], &[1.0]);
        setup.model.constants.insert("initial:p".to_owned(), start);
        let mut window: Window = window(&native, 10);
        window.inputs[0].values.fill(flow);
        setup.build().unwrap().run(&job(&window, &theta)).expect_err(term)
    };
    // Not a number from the first step on.
    let error = failure("a*sqrt(p - 1000)", 0.0, 80.0);
    let ParticleError::Model(error) = error else { panic!("{error}") };
    assert!(matches!(error, ModelFailure::NotFinite { .. } | ModelFailure::StepTooSmall { .. }), "{error}");
    // C falls through zero as the pressure rises to 90: the rate grows beyond all bounds on both sides.
    let error = failure("-a*p*1.0/90", 1000.0, 10.0);
    let ParticleError::Model(error) = error else { panic!("{error}") };
    assert!(
        matches!(
            error,
            ModelFailure::StepTooSmall { .. }
                | ModelFailure::TooManySteps { .. }
                | ModelFailure::NotFinite { .. }
        ),
        "{error}"
    );
    // A million steps of one equation take about a second.
    assert!(started.elapsed() < Duration::from_secs(60));
}

#[test]
fn a_shift_that_does_not_fit_is_refused_with_its_place() {
    let plain = chamber("throat", &[("throat", 1.0)]);
    let message = |adds: &[(&str, &str)], values: &[f64]| refused(&with(&plain, adds, values)).to_string();
    assert!(message(&[("throt", "a*p")], &[0.1]).contains("did you mean `throat`"));
    let own = message(&[("throat", "a*p*b"), ("b", "a")], &[0.1, 1.0]);
    assert!(own.contains("no state, output, input or parameter of the model named `b`"), "{own}");
    match refused(&with(&plain, &[("throat", "a*thrust")], &[0.1])) {
        SetupError::Expression { column, place, .. } => {
            assert_eq!((column, place.as_str()), (3, "effect shift, added to throat"));
        }
        other => panic!("{other}"),
    }
}
