//! What a nudging correction moves, and up to which gain it is stable.
#![allow(clippy::float_cmp)]
use super::*;
use crate::NativeModels;
use crate::equations::{EquationsDef, EquationsModel, OutputDef, StateDef};

/// A model whose outputs each show one state: names of outputs and states.
fn showing(list: &[(&str, &str)]) -> EquationsModel {
    let state = |&(_, name): &(&str, &str)| StateDef {
        name: name.to_owned(),
        initial: "1".to_owned(),
        rate: vec![(name.to_owned(), format!("-{name}"))],
        ..StateDef::default()
    };
    let output = |&(name, value): &(&str, &str)| OutputDef {
        name: name.to_owned(),
        value: value.to_owned(),
        ..OutputDef::default()
    };
    let (states, outputs) = (list.iter().map(state).collect(), list.iter().map(output).collect());
    EquationsModel::new(&EquationsDef { states, outputs, ..EquationsDef::default() }).expect("a model")
}

fn vessel() -> EquationsModel {
    showing(&[("pressure", "p")])
}

fn oscillator() -> EquationsModel {
    showing(&[("position", "x"), ("velocity", "v")])
}

fn def(gain: f64) -> ObserverDef {
    ObserverDef { kind: "nudging".to_owned(), gain, ..ObserverDef::default() }
}

fn wiring<'a>(model: &'a dyn Model, outputs: &'a [String]) -> Wiring<'a> {
    Wiring { spec: model.spec(), outputs, model, theta: &[], native: NativeModels::NONE }
}

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|&s| s.to_owned()).collect()
}

#[test]
fn the_pull_is_one_minus_exp_of_gain_times_time() {
    let model = vessel();
    let outputs = names(&["pressure"]);
    let observer = Nudging::new(&def(2.0), wiring(&model, &outputs)).expect("nudging");
    let mut x = [80.0];
    observer.correct(
        Correction {
            t: 1.0,
            spans: &[0.3],
            observed: &[100.0],
            predicted: &[90.0],
            model: &model,
            theta: &[],
        },
        &mut x,
    );
    // The same arithmetic written out; one rounding apart.
    assert!((x[0] - (80.0 + (1.0 - (-0.6_f64).exp()) * 10.0)).abs() < 1e-13, "{}", x[0]);
}

#[test]
fn a_missing_value_corrects_nothing_and_a_huge_gain_is_stable() {
    let model = oscillator();
    let outputs = names(&["velocity", "position"]);
    let observer = Nudging::new(&def(1e9), wiring(&model, &outputs)).expect("nudging");
    let mut x = [1.0, 2.0];
    let at = Correction {
        t: 1.0,
        spans: &[0.1; 2],
        observed: &[f64::NAN, 5.0],
        predicted: &[2.0, 1.0],
        model: &model,
        theta: &[],
    };
    observer.correct(at, &mut x);
    assert_eq!(x, [5.0, 2.0]);
}

#[test]
fn an_output_of_three_times_the_state_is_stable_below_the_logarithm_of_three() {
    let model = vessel();
    let outputs = names(&["pressure"]);
    // What a correction leaves of an error of one in the state, the datum being 3·10.
    let left = |gain: f64| {
        let observer = Nudging::new(&def(gain), wiring(&model, &outputs)).expect("nudging");
        let mut x = [11.0];
        let (observed, predicted) = ([30.0], [33.0]);
        let at = Correction {
            t: 1.0,
            spans: &[1.0],
            observed: &observed,
            predicted: &predicted,
            model: &model,
            theta: &[],
        };
        observer.correct(at, &mut x);
        x[0] - 10.0
    };
    // 1 − 3(1 − 3⁻¹) = −1 at γΔt = ln 3; the error turns over and shrinks below, and grows beyond.
    let bound = 3.0_f64.ln();
    assert!(left(0.99 * bound) > -1.0 && left(0.99 * bound) < -0.9, "{}", left(0.99 * bound));
    assert!(left(1.01 * bound) < -1.0, "{}", left(1.01 * bound));
}

#[test]
fn two_channels_of_one_state_pull_twice_as_fast_towards_their_mean() {
    let model = oscillator();
    let outputs = names(&["position", "velocity"]);
    let mut def = def(1.0);
    def.corrects.insert("velocity".to_owned(), "x".to_owned());
    let observer = Nudging::new(&def, wiring(&model, &outputs)).expect("nudging");
    let mut x = [0.0, 0.0];
    observer.correct(
        Correction {
            t: 0.5,
            spans: &[0.5; 2],
            observed: &[1.0, 3.0],
            predicted: &[0.0, 0.0],
            model: &model,
            theta: &[],
        },
        &mut x,
    );
    assert!((x[0] - 2.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-15, "{}", x[0]);
}

#[test]
fn a_channel_pulls_for_the_time_since_its_own_last_value() {
    let model = oscillator();
    let outputs = names(&["position", "velocity"]);
    let mut def = def(1.0);
    def.corrects.insert("velocity".to_owned(), "x".to_owned());
    let observer = Nudging::new(&def, wiring(&model, &outputs)).expect("nudging");
    let mut x = [0.0, 0.0];
    let (spans, observed, predicted) = ([0.1, 0.3], [1.0, 3.0], [0.0; 2]);
    let at = Correction {
        t: 0.5,
        spans: &spans,
        observed: &observed,
        predicted: &predicted,
        model: &model,
        theta: &[],
    };
    observer.correct(at, &mut x);
    // dx/dt = (z₁ − x) over 0.1 and (z₂ − x) over 0.3: together 0.4 towards 0.25 z₁ + 0.75 z₂.
    assert!((x[0] - 2.5 * (1.0 - (-0.4_f64).exp())).abs() < 1e-15, "{}", x[0]);
}

#[test]
fn an_unknown_name_in_corrects_offers_the_nearest() {
    let model = oscillator();
    let outputs = names(&["position"]);
    let mut def = def(1.0);
    def.corrects.insert("positon".to_owned(), "x".to_owned());
    let error = Nudging::new(&def, wiring(&model, &outputs)).expect_err("typo");
    assert!(error.to_string().contains("did you mean `position`"), "{error}");
}

#[test]
fn a_model_without_measured_states_is_refused() {
    let model = oscillator();
    let mut spec = model.spec().clone();
    spec.measures.clear();
    let outputs = names(&["position"]);
    let error =
        Nudging::new(&def(1.0), Wiring { spec: &spec, ..wiring(&model, &outputs) }).expect_err("no state");
    assert!(error.to_string().contains("corrects nothing"), "{error}");
}

/// x and v, and outputs of one or both.
fn mixed() -> EquationsModel {
    let mut def = EquationsDef {
        states: [("x", "1"), ("v", "0")]
            .map(|(name, initial)| StateDef {
                name: name.to_owned(),
                initial: initial.to_owned(),
                rate: vec![(name.to_owned(), "-1".to_owned())],
                ..StateDef::default()
            })
            .into(),
        ..EquationsDef::default()
    };
    let output = |(name, value): (&str, &str)| OutputDef {
        name: name.to_owned(),
        value: value.to_owned(),
        ..OutputDef::default()
    };
    def.outputs = [
        ("a", "x + 3*v"),
        ("b", "3*x + v"),
        ("c", "3*x"),
        ("d", "-x"),
        ("e", "v"),
        ("f", "v"),
        ("g", "v - 0.6*x"),
        ("h", "v - 0.6*x"),
        ("i", "v - 2*x"),
    ]
    .map(output)
    .into();
    EquationsModel::new(&def).expect("a model")
}

fn correcting(model: &EquationsModel, pairs: &[(&str, &str)]) -> Nudging {
    let outputs: Vec<String> = pairs.iter().map(|(output, _)| (*output).to_owned()).collect();
    let corrects = pairs.iter().map(|(o, s)| ((*o).to_owned(), (*s).to_owned())).collect();
    let def = ObserverDef { corrects, ..def(1.0) };
    Nudging::new(&def, wiring(model, &outputs)).expect("nudging")
}

#[test]
fn the_largest_stable_gain_is_that_of_the_eigenvalues_of_what_is_observed() {
    let model = mixed();
    let most = |pairs: &[(&str, &str)]| correcting(&model, pairs).stable_up_to(&model, &[], 0.5);
    let close = |found: Option<f64>, wanted: f64| {
        let found = found.expect("bounded");
        // Slopes by differences of linear outputs, and the tolerance of the search.
        assert!((found / wanted - 1.0).abs() < 1e-6, "{found} for {wanted}");
    };
    // h = 3: γΔt < ln(3/(3 − 2)).
    close(most(&[("c", "x")]), 3.0_f64.ln() / 0.5);
    // H = [1 3; 3 1] has the eigenvalues 4 and −2: the second grows at any gain.
    assert_eq!(most(&[("a", "x"), ("b", "v")]), Some(0.0));
    // Crossed, H = [3 1; 1 3] has 4 and 2: k < 2/4 of the whole innovation, γΔt < ln 2.
    close(most(&[("b", "x"), ("a", "v")]), 2.0_f64.ln() / 0.5);
    assert_eq!(most(&[("d", "x")]), Some(0.0), "an output that falls as its state rises");
    // Of states with other numbers of rows every one is pulled by a part of its own: v by more than x, which has h = 3.
    close(most(&[("c", "x"), ("e", "v"), ("f", "v")]), 3.0_f64.ln() / 0.5);
    // H = [−0.6 1; −2 1] has the eigenvalues 0.2 ± 1.17i, stable up to k = 0.286, but two rows of x make the trace of K H negative.
    close(most(&[("g", "x"), ("i", "v")]), -(1.0_f64 - 2.0 * 0.2 / 1.4).ln() / 0.5);
    assert_eq!(most(&[("g", "x"), ("h", "x"), ("i", "v")]), Some(0.0));
    // An output of two states of which one is corrected: h = 1.
    assert_eq!(most(&[("a", "x")]), None);
}

#[test]
fn the_feedback_holds_every_state_that_an_output_shows() {
    let model = mixed();
    let feedback = correcting(&model, &[("a", "x")]).feedback(&model, &[]);
    let wanted = DMatrix::from_row_slice(2, 2, &[1.0, 3.0, 0.0, 0.0]);
    // Differences of a linear output.
    assert!((feedback - wanted).amax() < 1e-9);
}
