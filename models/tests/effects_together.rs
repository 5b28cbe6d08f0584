//! Effects on outputs beside effects on inputs and parameters: a sensor reads what the shifted model shows.

mod common;

use common::{largest_difference, run, run_in_pieces, window};
use starlings_models::effect::names;
use starlings_models::equations::{EquationsDef, InputDef, OutputDef, StateDef};
use starlings_models::{Addition, BuildSetup, EffectDef, EffectParameter, ModelDef, Setup};

const CONSTANTS: [(&str, f64); 7] =
    [("throat", 1.0), ("a", 0.4), ("b", 0.437), ("g", 0.3), ("c", 0.2), ("d", 0.15), ("L", 0.05)];

/// A combustion chamber that an igniter fills.
fn chamber(rate: &str, thrust: &str, feed: &str) -> Setup {
    let state = |name: &str, initial: &str, rate: &str| StateDef {
        name: name.to_owned(),
        initial: initial.to_owned(),
        rate: vec![(name.to_owned(), rate.to_owned())],
        ..StateDef::default()
    };
    let output = |name: &str, value: &str| OutputDef {
        name: name.to_owned(),
        value: value.to_owned(),
        ..OutputDef::default()
    };
    let equations = EquationsDef {
        states: vec![state("p", "1", rate)],
        outputs: vec![output("thrust", thrust), output("feed", feed)],
        inputs: vec![InputDef { name: "flow".to_owned(), ..InputDef::default() }],
        ..EquationsDef::default()
    };
    let model = ModelDef {
        kind: "equations".to_owned(),
        equations: Some(equations),
        constants: CONSTANTS.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
        ..ModelDef::default()
    };
    Setup { model, outputs: vec!["thrust".to_owned(), "feed".to_owned()], ..Setup::default() }
}

/// The chamber with its throat and its flow written so.
fn written(throat: &str, flow: &str, thrust: &str, feed: &str) -> Setup {
    chamber(&format!("20*(3*max(p, 0)^0.3 + 0.01*{flow} - {throat}*p)"), thrust, feed)
}

/// The plain chamber with these terms, one effect for each.
fn extended(terms: &[(&str, &str)]) -> Setup {
    let mut setup = written("throat", "flow", "1.4*throat*p", "2*flow");
    for (i, (to, term)) in terms.iter().enumerate() {
        // Each needs an amplitude of its own.
        let amplitude = format!("one_{i}");
        setup.model.constants.insert(amplitude.clone(), 1.0);
        setup.effects.push(EffectDef {
            name: format!("effect {i}"),
            adds: vec![Addition { to: (*to).to_owned(), term: format!("{amplitude}*({term})") }],
            parameters: vec![EffectParameter { name: amplitude, ..EffectParameter::default() }],
            ..EffectDef::default()
        });
    }
    // A constant that nothing uses is refused.
    let used = names(&setup.effects).expect("terms that parse");
    setup.model.constants.retain(|name, _| name == "throat" || used.contains(name));
    setup
}

fn without_unused(mut setup: Setup) -> Setup {
    let spec = setup.spec().expect("the equations build");
    setup.model.constants.retain(|name, _| spec.parameters.iter().any(|q| q.name == *name));
    setup
}

#[test]
fn a_sensor_reads_what_the_model_shows_with_its_shifted_parameters_and_inputs() {
    let throat = "(throat + a*step(t - b))";
    let thrust = format!("1.4*{throat}*p");
    let step = ("throat", "a*step(t - b)");
    let cases = [
        // A wider throat, and a sensor of the thrust that reads too much.
        (
            "step and gain",
            vec![step, ("thrust", "g*thrust")],
            written(throat, "flow", &format!("1.3*{thrust}"), "2*flow"),
        ),
        // The same, and a sensor that answers late: it shows the wider throat later.
        (
            "step and delay",
            vec![step, ("thrust", "delay(thrust, d) - thrust")],
            written(throat, "flow", "1.4*(throat + a*step(t - d - b))*delay(p, d)", "2*flow"),
        ),
        // An input that was recorded too small, and a sensor of it.
        (
            "input and gain",
            vec![("flow", "c*flow + a"), ("feed", "g*feed")],
            written("throat", "(1.2*flow + a)", "1.4*throat*p", "2.6*(1.2*flow + a)"),
        ),
        // A term on an output reads the input that drives the model, and its slope.
        (
            "input and inertance",
            vec![("flow", "c*flow"), ("feed", "g*flow + L*ddt(flow)")],
            written("throat", "(1.2*flow)", "1.4*throat*p", "(2 + g)*1.2*flow + 1.2*L*ddt(flow)"),
        ),
        // The slope of an input that follows the state.
        (
            "an input that leaks and inertance",
            vec![("flow", "-c*p"), ("feed", "L*ddt(flow)")],
            written(
                "throat",
                "(flow - c*p)",
                "1.4*throat*p",
                "2*(flow - c*p) + L*(ddt(flow) - c*20*(3*max(p, 0)^0.3 + 0.01*(flow - c*p) - throat*p))",
            ),
        ),
    ];
    for (name, terms, by_hand) in cases {
        let (extended, by_hand) = (extended(&terms), without_unused(by_hand));
        let window = window(&extended, 40);
        let got = run(&*extended.build().expect(name), &window, &[]);
        let want = run(&*by_hand.build().expect(name), &window, &[]).outputs;
        // Integrated to a relative tolerance of 1e-8 per step, of values up to 100 and slopes up to 20.
        let error = largest_difference(&got.outputs, &want);
        assert!(error < 1e-5, "{name}: {error:e}");
        let pieces = run_in_pieces(&*extended.build().expect(name), &window, &[], 7);
        // What a run remembers travels from window to window as samples.
        let memory = !extended.build().expect(name).spec().states.iter().all(|q| q.name == "p");
        assert!(memory || pieces == got, "{name} in pieces");
        assert!(largest_difference(&pieces.outputs, &got.outputs) < 1e-5, "{name} in pieces");
    }
}
