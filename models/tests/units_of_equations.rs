//! What equations and effects say against the unit labels of a study.
#![allow(clippy::unwrap_used)]

use starlings_models::effect::{Addition, EffectParameter, EffectState};
use starlings_models::equations::{EquationsDef, InputDef, OutputDef, StateDef};
use starlings_models::units::{Labels, Mismatch};
use starlings_models::{BuildSetup, EffectDef, ModelDef, Setup, Spec};

/// A driven oscillator and an output of its energy; units as given for x, v, F and the energy.
fn oscillator(terms: &[(&str, &str)], energy: &str) -> EquationsDef {
    let state = |name: &str, unit: &str, rate: Vec<(String, String)>| StateDef {
        name: name.to_owned(),
        unit: unit.to_owned(),
        initial: "0".to_owned(),
        rate,
        ..StateDef::default()
    };
    let terms = terms.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect();
    EquationsDef {
        states: vec![state("x", "m", vec![("x".to_owned(), "v".to_owned())]), state("v", "m/s", terms)],
        outputs: vec![OutputDef {
            name: "energy".to_owned(),
            unit: "J".to_owned(),
            value: energy.to_owned(),
            ..OutputDef::default()
        }],
        inputs: vec![InputDef { name: "F".to_owned(), unit: "N".to_owned(), ..InputDef::default() }],
        ..EquationsDef::default()
    }
}

fn spec(def: &EquationsDef, effects: &[EffectDef]) -> Spec {
    let model =
        ModelDef { kind: "equations".to_owned(), equations: Some(def.clone()), ..ModelDef::default() };
    Setup { model, effects: effects.to_vec(), ..Setup::default() }.spec().unwrap()
}

const UNITS: [(&str, &str); 4] = [("m", "kg"), ("k", "N/m"), ("c", "N s/m"), ("w", "1/s")];

fn labels(spec: &Spec, units: &[(&str, &str)], time: &str) -> Labels {
    let mut labels = Labels::new(spec, time, true);
    for (name, unit) in units {
        labels.put(name, unit);
    }
    labels
}

fn told(terms: &[(&str, &str)], energy: &str, units: &[(&str, &str)], time: &str) -> Vec<String> {
    let def = oscillator(terms, energy);
    labels(&spec(&def, &[]), units, time).equations(&def).iter().map(Mismatch::to_string).collect()
}

const TERMS: [(&str, &str); 3] = [("spring", "-k*x/m"), ("viscous", "-c*v/m"), ("drive", "F/m")];
const ENERGY: &str = "0.5*m*v^2 + k*x^2/2";

#[test]
fn equations_whose_units_fit_are_not_spoken_of() {
    assert_eq!(told(&TERMS, ENERGY, &UNITS, "s"), [""; 0]);
    let fine = [
        "x*w^2 + 3",
        "sqrt(v^2)*w*exp(-w*t)",
        "if(x > 0, v*w, 0)",
        "max(F - c*v, 0)/m",
        "delay(F, 0.1)/m",
        "delay(F, 1/w)/m",
        "ddt(F)/(m*w)",
        "sin(6.28*t)*F/m",
        "step(t - 3)*F/m",
        "unknown*x",
        "9.81 - w*v*tanh(x/unknown)",
        "abs(v)*v/sqrt(x^2)",
        "(x/x)^unknown*w*v",
        "1000*x/(60*t)^2",
    ];
    for term in fine {
        assert_eq!(told(&[("a", term), ("b", "0")], ENERGY, &UNITS, "s"), [""; 0], "{term}");
    }
}

#[test]
fn a_term_of_another_unit_than_its_place_is_told_with_both() {
    let cases = [
        ("-k*x", "term `a` of the rate of `v`, `-k*x`: it is in N, expected m/s per s"),
        ("-v", "term `a` of the rate of `v`, `-v`: it is in m/s, expected m/s per s"),
        ("F/m + v", "term `a` of the rate of `v`, `F/m + v`: one side of a sum is in m/s, expected m/s^2"),
        (
            "(F - 2*x)/m",
            "term `a` of the rate of `v`, `(F - 2*x)/m`: one side of a difference is in m, expected N",
        ),
        (
            "w*v*exp(x)",
            "term `a` of the rate of `v`, `w*v*exp(x)`: the argument of `exp` is in m, expected a plain number",
        ),
        (
            "w*v*sin(x*t)",
            "term `a` of the rate of `v`, `w*v*sin(x*t)`: the argument of `sin` is in m s, expected a plain number",
        ),
        (
            "delay(F, x)/m",
            "term `a` of the rate of `v`, `delay(F, x)/m`: the time of `delay` is in m, expected s",
        ),
        (
            "if(x > v, F/m, 0)",
            "term `a` of the rate of `v`, `if(x > v, F/m, 0)`: one side of a comparison is in m/s, expected m",
        ),
        (
            "min(F, x)/m",
            "term `a` of the rate of `v`, `min(F, x)/m`: an argument of `min` is in m, expected N",
        ),
        ("w*v*2^x", "term `a` of the rate of `v`, `w*v*2^x`: an exponent is in m, expected a plain number"),
        ("sqrt(x)*w^2", "term `a` of the rate of `v`, `sqrt(x)*w^2`: it is in m^0.5/s^2, expected m/s per s"),
        ("ddt(F)/m", "term `a` of the rate of `v`, `ddt(F)/m`: it is in m/s^3, expected m/s per s"),
    ];
    for (term, expected) in cases {
        assert_eq!(told(&[("a", term), ("b", "0")], ENERGY, &UNITS, "s"), [expected], "{term}");
    }
}

#[test]
fn a_wrong_unit_of_one_parameter_is_told_once() {
    let wrong = [("m", "kg"), ("k", "N"), ("c", "N s/m")];
    let expected = ["term `spring` of the rate of `v`, `-k*x/m`: it is in m^2/s^2, expected m/s per s"];
    assert_eq!(told(&TERMS, "0.5*m*v^2", &wrong, "s"), expected);
}

#[test]
fn a_factor_of_a_thousand_is_told_unless_a_number_converts_it() {
    let in_grams = [("m", "g"), ("k", "N/m")];
    let drive = |term: &'static str| [("drive", term), ("rest", "0")];
    let expected = "term `drive` of the rate of `v`, `F/m`: it is in 1000 m/s^2, expected m/s per s";
    assert_eq!(told(&drive("F/m"), "k*x^2/2", &in_grams, "s"), [expected]);
    assert_eq!(told(&drive("1000*F/m"), "k*x^2/2", &in_grams, "s"), [""; 0]);
    assert_eq!(
        told(&drive("F/m"), "k*x^2/2", &UNITS, "ms"),
        [
            "rate of `x`, `v`: it is in m/s, expected m/ms",
            "term `drive` of the rate of `v`, `F/m`: it is in m/s^2, expected m/s per ms"
        ]
    );
    assert_eq!(
        told(&drive("F/m"), "k*x^2/2", &UNITS, "beats per minute"),
        [""; 0],
        "an unknown time fits all"
    );
}

#[test]
fn the_terms_of_an_effect_are_compared_with_what_they_are_added_to() {
    let add = |to: &str, term: &str| Addition { to: to.to_owned(), term: term.to_owned() };
    let parameter = |name: &str, unit: &str| EffectParameter {
        name: name.to_owned(),
        unit: unit.to_owned(),
        ..EffectParameter::default()
    };
    let effect = EffectDef {
        name: "cubic".to_owned(),
        adds: vec![add("v", "-q*x^3/m"), add("energy", "q*x^4/4 + z"), add("F", "q*x*z")],
        parameters: vec![parameter("q", "N/m^3")],
        states: vec![EffectState {
            name: "z".to_owned(),
            unit: "J".to_owned(),
            rate: "F*x".to_owned(),
            ..EffectState::default()
        }],
        ..EffectDef::default()
    };
    let def = oscillator(&TERMS, ENERGY);
    let spec = spec(&def, std::slice::from_ref(&effect));
    let told: Vec<String> =
        labels(&spec, &UNITS, "s").effect(&effect, &spec).iter().map(Mismatch::to_string).collect();
    assert_eq!(
        told,
        [
            "effect `cubic`, added to `F`, `q*x*z`: it is in m kg^2/s^4, expected N",
            "effect `cubic`, rate of `z`, `F*x`: it is in J, expected J/s"
        ]
    );
}
