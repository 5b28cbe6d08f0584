//! Where built-in effects grow, and what they are called there.
#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod library_kit;

use library_kit::benches;
use starlings_models::effect::library::{library, library_in, shows_in, stem, write_out};
use starlings_models::native::{Oscillator, Windkessel2};
use starlings_models::{BuildSetup, EffectDef, Model, SetupError, Spec};

#[test]
fn a_pressure_outlet_with_a_flow_hosts_a_series_resistance() {
    let library = library(Windkessel2::default().spec());
    let effect = library.iter().find(|effect| effect.name == "series-resistance").unwrap();
    assert_eq!((effect.adds[0].to.as_str(), effect.adds[0].term.as_str()), ("pressure", "Rs*flow"));
    assert_eq!(effect.parameters[0].unit, "mmHg s/mL");
}

#[test]
fn an_oscillator_hosts_friction_and_no_series_resistance() {
    let library = library(Oscillator::default().spec());
    let names: Vec<&str> = library.iter().map(|e| e.name.as_str()).collect();
    assert!(names.contains(&"coulomb-friction"), "{names:?}");
    let rounding: Vec<&str> = library
        .iter()
        .flat_map(|e| &e.parameters)
        .filter(|p| p.is_rounding)
        .map(|p| p.name.as_str())
        .collect();
    assert_eq!(rounding, ["v_coulomb", "w_stribeck"]);
    assert!(!names.contains(&"series-resistance"), "{names:?}");
}

#[test]
fn two_places_of_a_kind_get_names_of_their_own_and_one_needs_none() {
    let names =
        |spec: &Spec| -> Vec<String> { library(spec).into_iter().map(|effect| effect.name).collect() };
    let mut spec = Oscillator::default().spec().clone();
    assert!(names(&spec).contains(&"quadratic-drag".to_owned()));
    for mut state in spec.states.clone() {
        state.name.push('2');
        spec.states.push(state);
    }
    let found = names(&spec);
    assert!(
        found.contains(&"quadratic-drag:v".to_owned()) && found.contains(&"quadratic-drag:v2".to_owned())
    );
    let second = library(&spec).into_iter().find(|effect| effect.name == "linear-support:v2").unwrap();
    assert_eq!(
        second.adds[0].term, "-k_support_v2*x2",
        "the second velocity belongs to the second displacement"
    );
}

#[test]
fn one_velocity_between_two_displacements_has_one_friction_and_two_springs() {
    let mut spec = Oscillator::default().spec().clone();
    let mut other = spec.states.iter().find(|q| q.name == "x").unwrap().clone();
    other.name = "z".to_owned();
    spec.states.push(other);
    let effects = library(&spec);
    let places = |kind: &str| -> Vec<&str> {
        effects.iter().map(|effect| effect.name.as_str()).filter(|name| stem(name) == kind).collect()
    };
    for kind in ["viscous-friction", "coulomb-friction", "stribeck-friction", "quadratic-drag"] {
        assert_eq!(places(kind), [kind]);
    }
    for kind in ["bias-force", "periodic-forcing"] {
        assert_eq!(places(kind), [kind]);
    }
    assert_eq!(places("linear-support"), ["linear-support:v:x", "linear-support:v:z"]);
    assert_eq!(places("backlash"), ["backlash:v:x", "backlash:v:z"]);
}

#[test]
fn a_built_in_effect_is_written_out_in_the_time_unit_of_the_study() {
    let def = EffectDef { built_in: Some("sensor-drift".to_owned()), ..EffectDef::default() };
    let unit =
        |time: &str| write_out(&def, Windkessel2::default().spec(), time).unwrap().parameters[0].unit.clone();
    assert_eq!((unit("s").as_str(), unit("min").as_str()), ("mmHg/s", "mmHg/min"));
}

#[test]
fn numbers_that_count_in_a_course_are_neither_range_nor_default_in_the_models_units() {
    let bench = benches().into_iter().find(|bench| bench.name == "one tank").unwrap();
    let overflow = library(&bench.spec).into_iter().find(|effect| effect.name == "overflow").unwrap();
    let mut setup = bench.setup.clone();
    setup.effects.push(EffectDef { built_in: Some("overflow".to_owned()), ..EffectDef::default() });
    let rim = &overflow.parameters[1].name;
    let missing = setup.build().map(|_| ()).unwrap_err();
    assert_eq!(missing, SetupError::Missing { model: "equations".to_owned(), name: rim.clone() });
    // A level of 24 is beyond the course of 0.05 to 0.98.
    setup.model.constants.insert(rim.clone(), 24.0);
    setup.build().map(|_| ()).unwrap();
    // A memory is as long as some bound on its delay.
    setup.effects[0].built_in = Some("sensor-delay".to_owned());
    setup.model.constants.remove(rim);
    setup.build().map(|_| ()).unwrap();
}

#[test]
fn a_name_that_the_model_has_itself_is_avoided() {
    let mut spec = Oscillator::default().spec().clone();
    spec.parameters.push(starlings_models::Quantity::new("c_viscous", ""));
    let effect = library(&spec).into_iter().find(|effect| effect.name == "viscous-friction").unwrap();
    assert_eq!(effect.parameters[0].name, "c_viscous_");
}

#[test]
fn a_coefficient_counts_in_the_time_unit_of_the_study() {
    let drift = |time: &str| {
        let effects = library_in(Windkessel2::default().spec(), time);
        effects.into_iter().find(|effect| effect.name == "sensor-drift").unwrap().parameters[0].unit.clone()
    };
    assert_eq!((drift("s").as_str(), drift("h").as_str()), ("mmHg/s", "mmHg/h"));
}

#[test]
fn an_effect_on_an_output_shows_only_in_that_output() {
    let spec = Oscillator::default().spec().clone();
    let effects = library(&spec);
    let find = |name: &str| effects.iter().find(|effect| effect.name == name).unwrap();
    let measured = ["position".to_owned()];
    assert!(shows_in(find("sensor-offset:position"), &spec, &measured));
    assert!(!shows_in(find("sensor-offset:velocity"), &spec, &measured));
    assert!(shows_in(find("quadratic-drag"), &spec, &measured));
}

#[test]
fn a_sensor_of_an_output_named_as_its_state_leaves_the_state_alone() {
    let bench = benches().into_iter().find(|bench| bench.name == "one tank").unwrap();
    let offset = library(&bench.spec).into_iter().find(|effect| effect.name == "sensor-offset").unwrap();
    assert_eq!(offset.adds[0].to, "output:h");
    let (plain, with) = (bench.run(&[], 0.0).unwrap(), bench.run(&[offset], 0.5).unwrap());
    // One sum of two numbers near one.
    assert!(plain.iter().zip(&with).all(|(a, b)| (b - a - 0.5).abs() < 1e-12), "{plain:?} {with:?}");
}

#[test]
fn a_lag_of_the_sensor_is_that_of_first_order() {
    let bench = benches().into_iter().find(|bench| bench.name == "ramp").unwrap();
    let lag = library(&bench.spec).into_iter().find(|effect| effect.name == "sensor-lag").unwrap();
    let lag = bench.resolved(&lag).unwrap();
    // A lag of first order shows sin(w t) as (sin(w t) - w tau cos(w t))/(1 + (w tau)^2) once the start is forgotten.
    let (w, tau) = (8.0, 0.03);
    let got = bench.run(&[lag], tau).unwrap();
    // The rows are the output and the state.
    for (t, value) in bench.window.times.iter().zip(got.iter().step_by(2)).filter(|(t, _)| **t > 0.5) {
        let want = ((w * t).sin() - w * tau * (w * t).cos()) / (1.0 + (w * tau) * (w * tau));
        // The scatter of ages within the cells is lost, 0.037 tau^2, and half of it times (w tau)^2 = 0.06 is 1e-3.
        assert!((value - want).abs() < 2e-3, "{t}: {value} instead of {want}");
    }
}

#[test]
fn a_lag_of_no_time_is_no_lag() {
    let bench = benches().into_iter().find(|bench| bench.name == "ramp").unwrap();
    let lag = library(&bench.spec).into_iter().find(|effect| effect.name == "sensor-lag").unwrap();
    let (plain, with) = (bench.run(&[], 0.0).unwrap(), bench.run(&[lag], 0.0).unwrap());
    // The output depends on time alone, and its past ends with its value now: every difference is zero.
    assert!(plain.iter().zip(&with).step_by(2).all(|(a, b)| (a - b).abs() < 1e-15), "{plain:?} {with:?}");
}

#[test]
fn a_mistyped_built_in_effect_offers_the_nearest() {
    let def = EffectDef { built_in: Some("serial-resistance".to_owned()), ..EffectDef::default() };
    let error = write_out(&def, Windkessel2::default().spec(), "s").unwrap_err();
    assert!(error.to_string().contains("did you mean `series-resistance`"), "{error}");
}
