//! Built-in effects whose numbers count in the course of a quantity, the record or its sampling, in studies and twins.
#![allow(clippy::unwrap_used)]
mod study_kit;

use starlings_coordinator::study::Study;
use starlings_coordinator::study::twin::{Recording, Twin, simulate};
use starlings_models::Quantity;
use study_kit::{Case, csv, grid};

/// Spacing of the recording, in the study's time unit.
const STEP: f64 = 5.0;

/// A tank in mm and minutes that fills from 10 towards 40, with an effect and constants for it.
fn tank(effect: &str, constants: &str, parameters: &str) -> String {
    format!(
        r#"
[study]
name = "tank"
time_unit = "min"
[model]
kind = "equations"
constants = {{ T = 60.0{constants} }}
inputs = [ {{ name = "u", unit = "mm" }} ]
outputs = [ {{ name = "reading", unit = "mm", role = "level", value = "h" }} ]
[[model.states]]
name = "h"
unit = "mm"
role = "level"
initial = 10.0
rate = "(g*u - h)/T"
[[effects]]
{effect}
[[parameters]]
name = "g"
prior = {{ transform = "log", median = 1.0, factor = 1.5 }}
{parameters}
[[records]]
name = "one"
file = "tank.csv"
inputs = {{ u = "u" }}
channels = [ {{ column = "h", output = "reading", noise = 0.5 }} ]
"#
    )
}

fn case(study: &str) -> Case {
    let times = grid(61, STEP);
    let data = csv("time,h,u", &[&times, &vec![20.0; 61], &vec![40.0; 61]]);
    Case::new(study, &[("tank.csv", data)])
}

fn load(effect: &str, constants: &str, parameters: &str) -> Study {
    case(&tank(effect, constants, parameters)).study()
}

fn refusal(effect: &str, constants: &str) -> String {
    let case = case(&tank(effect, constants, ""));
    Study::load(&case.fresh().with_file_name("study.toml")).unwrap_err().to_string()
}

fn parameter<'a>(study: &'a Study, name: &str) -> &'a Quantity {
    study.spec.parameters.iter().find(|q| q.name == name).unwrap()
}

fn twin(study: &Study, values: &[(&str, f64)], effects: &[(&str, f64)]) -> Recording {
    let named = |list: &[(&str, f64)]| list.iter().map(|(name, v)| ((*name).to_owned(), *v)).collect();
    simulate(study, &Twin { values: named(values), effects: named(effects), ..Twin::default() }).unwrap()
}

/// The level without effects: T h' = u − h.
fn level(t: f64) -> f64 {
    40.0 - 30.0 * (-t / 60.0).exp()
}

/// The largest difference of the readings.
fn difference(a: &Recording, b: &Recording) -> f64 {
    a.values[0].iter().zip(&b.values[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

const OVERFLOW: &str = "name = \"spill\"\nbuilt_in = \"overflow\"";

#[test]
fn a_threshold_is_given_in_the_unit_of_its_level() {
    let study = load(OVERFLOW, ", q_over = 0.1, rim = 24.0", "");
    assert!(study.warnings.is_empty(), "{:?}", study.warnings);
    let by_hand = "name = \"spill\"\nadds = [ { to = \"h\", term = \"-q*max(h - rim, 0)\" } ]\n\
                   parameters = [ { name = \"q\" }, { name = \"rim\" } ]";
    let written = load(by_hand, ", q = 0.1, rim = 24.0", "");
    let (got, want) = (twin(&study, &[], &[]), twin(&written, &[], &[]));
    // The same equations: rounding of values near 30.
    assert!(difference(&got, &want) < 1e-9, "{}", difference(&got, &want));
    // T h' = 40 − h − 6 (h − 24) settles at 184/7.
    assert!((got.values[0][60] - 184.0 / 7.0).abs() < 1e-3, "{}", got.values[0][60]);
}

#[test]
fn a_threshold_that_is_not_given_stands_on_the_course_of_its_level() {
    let study = load(OVERFLOW, ", q_over = 0.1", "");
    let want = 10.0 + 0.7 * (level(300.0) - 10.0);
    let got = parameter(&study, "rim").default.unwrap();
    // The course is integrated to 1e-8 per step.
    assert!((got - want).abs() < 1e-5, "{got} instead of {want}");
}

#[test]
fn a_threshold_can_be_estimated_in_the_unit_of_its_level() {
    let rim = |median: f64| {
        let parameters = format!(
            "[[parameters]]\nname = \"rim\"\nprior = {{ transform = \"log\", median = {median}, factor = 1.2 }}"
        );
        load(OVERFLOW, ", q_over = 0.1", &parameters)
    };
    let study = rim(24.0);
    assert!(study.warnings.is_empty(), "{:?}", study.warnings);
    // Beyond the course at the prior medians: accepted with a warning.
    let study = rim(45.0);
    assert_eq!(study.warnings.len(), 1, "{:?}", study.warnings);
    let warning = &study.warnings[0];
    assert!(
        warning.starts_with("the prior median of `rim` is 45 mm, and a search would look from 11.4"),
        "{warning}"
    );
}

#[test]
fn what_moves_too_little_to_count_on_needs_a_value() {
    let effect = "name = \"limit\"\nbuilt_in = \"sensor-saturation\"";
    let still = tank(effect, ", sensor_clipped = 1.0", "").replace("initial = 10.0", "initial = 40.0");
    // At the prior median the level stays at the input's.
    let still = case(&still);
    let error = Study::load(&still.fresh().with_file_name("study.toml")).unwrap_err().to_string();
    assert!(error.contains("parameter `sensor_limit` of model `equations` has no value"), "{error}");
}

#[test]
fn a_delay_is_bounded_by_the_sampling_of_the_record() {
    let delay = "name = \"late\"\nbuilt_in = \"sensor-delay\"";
    let study = load(delay, ", sensor_delay = 60.0", "");
    assert_eq!(parameter(&study, "sensor_delay").unit, "min");
    // Thirty intervals of five minutes.
    assert!((parameter(&study, "sensor_delay").range[1] - 150.0).abs() < 1e-9);
    let got = twin(&study, &[], &[]);
    for (t, value) in got.times.iter().zip(&got.values[0]) {
        // Cubics between samples of the past, and the integration to 1e-8 per step.
        assert!((value - level((t - 60.0).max(0.0))).abs() < 1e-4, "{t}: {value}");
    }
    let error = refusal(delay, ", sensor_delay = 200.0");
    assert!(error.contains("`sensor_delay` is 200") && error.contains("0 to 150"), "{error}");
}

#[test]
fn what_starts_with_the_record_needs_no_value_and_counts_in_the_time_unit_of_the_study() {
    let study = load("name = \"drift\"\nbuilt_in = \"sensor-drift\"", ", sensor_drift = 0.5", "");
    assert!(study.warnings.is_empty(), "{:?}", study.warnings);
    assert_eq!(parameter(&study, "sensor_drift").unit, "mm/min");
    let got = twin(&study, &[], &[]);
    let want = level(100.0) + 0.5 * 100.0;
    assert!((got.values[0][20] - want).abs() < 1e-5, "{} instead of {want}", got.values[0][20]);
}

#[test]
fn a_twin_takes_the_numbers_of_an_effect_on_the_course_of_its_own_run() {
    let candidate = OVERFLOW.replace("spill", "over the rim");
    let study = load(&candidate, "", "");
    assert_eq!(study.candidates.len(), 1);
    let rim = |gain: f64| {
        let end = 40.0 * gain - (40.0 * gain - 10.0) * (-300.0_f64 / 60.0).exp();
        10.0 + 0.7 * (end - 10.0)
    };
    for gain in [1.0, 2.0] {
        for name in ["overflow", "over the rim"] {
            let by_default = twin(&study, &[("g", gain)], &[(name, 0.1)]);
            let by_value = twin(&study, &[("g", gain), ("rim", rim(gain))], &[(name, 0.1)]);
            let plain = twin(&study, &[("g", gain)], &[]);
            // The course is integrated to 1e-8 per step.
            assert!(difference(&by_default, &by_value) < 1e-4, "{}", difference(&by_default, &by_value));
            assert!(difference(&by_default, &plain) > 1.0);
        }
    }
}
