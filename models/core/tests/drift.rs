//! The functions of a drift that is linear in unknown parameters.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

use std::collections::BTreeMap;

use starlings_models_core::equations::{Drift, EquationsDef, EquationsModel, InputDef, OutputDef, StateDef};
use starlings_models_core::{Drive, Model, SetupError};

fn state(name: &str, rate: &str) -> StateDef {
    StateDef {
        name: name.to_owned(),
        initial: "0".to_owned(),
        rate: vec![(name.to_owned(), rate.to_owned())],
        ..StateDef::default()
    }
}

fn def(rates: &[(&str, &str)]) -> EquationsDef {
    EquationsDef {
        states: rates.iter().map(|(name, rate)| state(name, rate)).collect(),
        outputs: vec![OutputDef {
            name: "flow".to_owned(),
            value: "max(a - H, 0) - max(b - H, 0)".to_owned(),
            ..OutputDef::default()
        }],
        inputs: vec![InputDef { name: "u".to_owned(), ..InputDef::default() }],
        ..EquationsDef::default()
    }
}

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|name| (*name).to_owned()).collect()
}

const TANKS: [(&str, &str); 2] = [
    ("a", "u - c*flow + if(t > 1, e*sin(t), -2*e) - L*sqrt(max(a - H, 0))/area"),
    ("b", "c*flow - k^2*b + (e - c)*b/4"),
];

fn constants() -> BTreeMap<String, f64> {
    [("H", 0.5), ("k", 3.0), ("area", 2.0)].map(|(name, value)| (name.to_owned(), value)).into()
}

#[test]
fn known_part_and_functions_add_up_to_the_rates() {
    let (def, constants) = (def(&TANKS), constants());
    let unknown = names(&["c", "e", "L"]);
    let drift = Drift::of_rates(&def, &constants, &unknown, &[]).unwrap();
    let model = EquationsModel::with_constants(&def, &constants).unwrap();
    let values: BTreeMap<&str, f64> =
        [("c", 2.0), ("e", -0.7), ("L", 0.3), ("H", 0.5), ("k", 3.0), ("area", 2.0)].into();
    let theta: Vec<f64> = model.spec().parameters.iter().map(|q| values[q.name.as_str()]).collect();
    for (t, x, u) in [(0.5, [0.9, 0.6], [0.1]), (2.0, [0.2, 0.1], [-0.4])] {
        let mut expected = [0.0; 2];
        let input = Drive { value: &u, ..Drive::NONE };
        model.rhs(t, &x, &theta, input, &mut expected);
        let mut found = [0.0; 2];
        for (factor, places) in std::iter::once((1.0, &drift.known))
            .chain(unknown.iter().map(|name| values[name.as_str()]).zip(&drift.places))
        {
            for place in places {
                found[place.equation] +=
                    factor * place.factor * drift.functions[place.function].value(t, &x, &u);
            }
        }
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-13, "rounding of a dozen terms: {found} for {expected}");
        }
    }
}

#[test]
fn a_flow_that_leaves_one_equation_and_enters_another_is_one_function() {
    let rates = [("a", "-c*flow"), ("b", "c*flow"), ("d", "0.5*(c*flow)")];
    let drift = Drift::of_rates(&def(&rates), &constants(), &names(&["c"]), &[]).unwrap();
    assert_eq!(drift.functions.len(), 1);
    let places: Vec<(usize, f64)> =
        drift.places[0].iter().map(|place| (place.equation, place.factor)).collect();
    assert_eq!(places, [(0, -1.0), (1, 1.0), (2, 0.5)]);
}

#[test]
fn a_function_that_one_equation_takes_at_the_left_point_is_another_one_there() {
    let rates = [("a", "-c*b"), ("b", "c*b")];
    let drift = Drift::of_rates(&def(&rates), &constants(), &names(&["c"]), &names(&["a"])).unwrap();
    let left: Vec<bool> = drift.functions.iter().map(|function| function.left).collect();
    assert_eq!(left, [true, false]);
}

#[test]
fn slopes_are_those_of_differences() {
    let drift = Drift::of_rates(&def(&TANKS), &constants(), &names(&["c", "e", "L"]), &[]).unwrap();
    let (t, x, u, h) = (0.5, [0.9, 0.6], [0.1], 1e-6);
    for function in &drift.functions {
        let mut slopes = [0.0; 2];
        function.slopes(t, &x, &u, &mut [0.0; 2], &mut slopes);
        for l in 0..2 {
            let at = |side: f64| {
                let mut moved = x;
                moved[l] += side * h;
                function.value(t, &moved, &u)
            };
            let difference = (at(1.0) - at(-1.0)) / (2.0 * h);
            // Second order in h, and rounding of values of size one over it.
            assert!((slopes[l] - difference).abs() < 1e-8, "{}: {} {difference}", function.name, slopes[l]);
        }
    }
}

#[test]
fn what_is_not_linear_is_refused_with_its_name() {
    for (rate, name) in [
        ("-c^2*a", "c"),
        ("exp(c)*a", "c"),
        ("c*e*a", "c"),
        ("a/(1 + c)", "c"),
        ("if(c > 0, a, 0)", "c"),
        ("a/e + c", "e"),
    ] {
        let refused =
            Drift::of_rates(&def(&[("a", rate), ("b", "e*c0*b")]), &constants(), &names(&["c", "e"]), &[]);
        let Err(SetupError::Expression { message, .. }) = refused else { panic!("{rate} was accepted") };
        assert_eq!(message, format!("the rate is not linear in `{name}`"), "{rate}");
    }
}

#[test]
fn a_name_that_no_rate_has_and_a_look_into_the_past_are_refused() {
    let rates = [("a", "sigma*b"), ("b", "-b")];
    let refused = Drift::of_rates(&def(&rates), &constants(), &names(&["sgima"]), &[]);
    assert!(matches!(refused, Err(SetupError::Unknown { nearest: Some(near), .. }) if near == "sigma"));
    let past = [("a", "c*delay(u, 0.5)"), ("b", "-b")];
    let refused = Drift::of_rates(&def(&past), &constants(), &names(&["c"]), &[]);
    assert!(matches!(refused, Err(SetupError::Expression { message, .. }) if message.contains("no `delay`")));
}
