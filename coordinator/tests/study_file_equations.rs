//! Good studies of a model in equations: its terms, effects and delays, automatic noise, and held-out values unseen.
// Values that are copied or chosen exactly are compared exactly; the helpers of a test file are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod study_kit;

use std::fmt::Write as _;

use starlings_coordinator::study::Study;
use starlings_models::Window;
use study_kit::Case;

/// Values above this stand only where nothing may be fitted.
const SECRET: f64 = 1e6;

const SPRING: &str = r#"
[study]
name = "spring"
[model]
kind = "equations"
constants = { m = 1.0 }
outputs = [ { name = "position", value = "x" }, { name = "speed", value = "v" } ]
[[model.states]]
name = "x"
initial = "a0/2"
rate = "v"
[[model.states]]
name = "v"
initial = 0
rate = { zeta = "-c*v/m", alpha = "-k*x/m" }
[[parameters]]
name = "k"
prior = { transform = "log", median = 3.0, factor = 2.0 }
[[parameters]]
name = "c"
prior = { transform = "log", median = 0.1, factor = 2.0 }
[[parameters]]
name = "a0"
prior = { transform = "linear", mean = 1.0, sd = 0.2 }
[[records]]
name = "swing"
file = "swing.csv"
time = "t"
channels = [
  { column = "x", output = "position", noise = "auto" },
  { column = "v", output = "speed", noise = 0.1 },
]
train = [0.0, 6.0]
[explain]
hold_out_channels = ["speed"]
"#;

/// A swing with noise of sd 0.02; the speed, and everything after t = 6, is secret.
fn swing(later: f64) -> String {
    let mut state = 1_u64;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut text = "t,x,v\n".to_owned();
    for i in 0..900 {
        let t = 0.01 * f64::from(i);
        let noise = 0.02 * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0);
        let x = (1.7 * t).cos() + noise;
        let x = match i {
            100..110 => String::new(),
            601.. => format!("{}", later * (1.0 + uniform())),
            _ => x.to_string(),
        };
        writeln!(text, "{t:.2},{x},{}", SECRET + f64::from(i)).unwrap();
    }
    text
}

fn load(study: &str, later: f64) -> Study {
    Case::new(study, &[("swing.csv", swing(later))]).study()
}

#[test]
fn held_out_values_are_in_no_window() {
    for every in [1, 7, 1000] {
        let text = SPRING.replace("train = ", &format!("every = {every}\ntrain = "));
        let study = load(&text, SECRET);
        let windows: Vec<Window> = study
            .windows(0)
            .iter()
            .map(|w| (**w).clone())
            .chain([study.whole(0, true), study.whole(0, false)])
            .collect();
        let seen: Vec<f64> =
            windows.iter().flat_map(|w| w.observed.clone()).filter(|v| v.is_finite()).collect();
        assert_eq!(
            seen.len(),
            2 * 591,
            "each of the 601 training rows less 10 gaps, in the windows and in the whole"
        );
        assert!(seen.iter().all(|v| *v < SECRET));
        assert!(study.windows(0).iter().flat_map(|w| &w.times).all(|t| *t <= 6.0));
    }
}

#[test]
fn automatic_noise_comes_from_the_training_rows_alone_and_is_told() {
    let study = load(SPRING, SECRET);
    let noise = study.records[0].channels[0].noise;
    // 588 overlapping differences know the sd to about 5 %.
    assert!((noise / 0.02 - 1.0).abs() < 0.15, "{noise}");
    assert_eq!(load(SPRING, -3.0).records[0].channels[0].noise, noise);
    assert!(study.warnings.iter().any(|w| w.contains("noise of `position`")), "{:?}", study.warnings);
    assert_eq!(study.noise(0), [noise, 0.1]);
    assert!(study.records[0].channels[1].held_out);
}

#[test]
fn equations_keep_the_order_of_their_terms_and_their_initial_expressions() {
    let study = load(SPRING, 0.0);
    let def = study.setup.model.equations.as_ref().unwrap();
    let terms: Vec<&str> = def.states[1].rate.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(terms, ["zeta", "alpha"]);
    assert_eq!(def.states[0].initial, "a0/2");
    assert_eq!(def.states[0].rate, [("x".to_owned(), "v".to_owned())]);
    assert_eq!(study.setup.outputs, ["position", "speed"]);
}

#[test]
fn an_effect_belongs_to_the_model_once_one_of_its_parameters_has_a_value() {
    let effect = r#"
[[effects]]
name = "stiffening"
says = "the spring grows stiffer"
adds = [ { to = "v", term = "-q*x^3/m" } ]
parameters = [ { name = "q", range = [0, 5] } ]
"#;
    let study = load(&format!("{SPRING}{effect}"), 0.0);
    assert!(study.setup.effects.is_empty());
    assert_eq!(study.candidates[0].name, "stiffening");
    let parameter = "[[parameters]]\nname = \"q\"\nprior = { transform = \"log\", median = 1, factor = 2 }\n";
    let study = load(&format!("{SPRING}{effect}{parameter}"), 0.0);
    assert_eq!(study.setup.effects[0].name, "stiffening");
    assert!(study.candidates.is_empty());
    assert_eq!(study.setup.parameters, ["k", "c", "a0", "q"]);
    assert!(study.spec.parameters.iter().any(|q| q.name == "q"));
}

#[test]
fn a_delayed_input_keeps_the_whole_past_in_every_window() {
    let study = SPRING
        .replace("outputs = [", "inputs = [ { name = \"F\" } ]\noutputs = [")
        .replace("\"-k*x/m\"", "\"-k*x/m + delay(F, 1.0)\"")
        .replace("time = \"t\"", "time = \"t\"\ninputs = { F = \"v\" }");
    let study = load(&study, 0.0);
    let windows = study.windows(0);
    let last = windows.last().unwrap();
    assert!(study.delays);
    assert_eq!(last.inputs[0].times[0], 0.0);
}
