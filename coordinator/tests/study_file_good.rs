//! Good studies: what becomes of parameters, records, noise and windows, and that held-out values stay unseen.
// Values that are copied or chosen exactly are compared exactly; the helpers of a test file are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

use std::fmt::Write as _;
use std::sync::Arc;

use starlings_coordinator::study::Study;
use starlings_estimators::{Drift, Points, Transform};
use starlings_models::{Job, Window};

/// Values above this stand only where nothing may be fitted.
const SECRET: f64 = 1e6;

/// Loads a study whose folder holds these files.
fn load(study: &str, files: &[(&str, String)]) -> Study {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let file = folder.path().join("study.toml");
    std::fs::write(&file, study).unwrap();
    Study::load(&file).unwrap_or_else(|error| panic!("{error}"))
}

/// An aortic record: pressure is secret from the given time on.
fn aorta(offset: f64, secret_from: f64) -> String {
    let mut text = "time,pressure,flow\n".to_owned();
    for i in 0..60 {
        let t = 0.05 * f64::from(i);
        let pressure =
            if t < secret_from { 90.0 + offset + 20.0 * (6.0 * t).sin() } else { SECRET + f64::from(i) };
        writeln!(text, "{t:.2},{pressure:.4},{:.4}", 50.0 * (6.0 * t).cos()).unwrap();
    }
    text
}

const AORTA: &str = r#"
[study]
name = "aorta"
[model]
kind = "windkessel-3"
[[parameters]]
name = "R"
per_record = true
prior = { transform = "log", median = 3.0, factor = 2.0 }
[[parameters]]
name = "C"
prior = { transform = "log2", median = 2.0, factor = 4.0 }
process = { forgetting = 0.98 }
[[parameters]]
name = "Zc"
unit = "kPa s/mL"
prior = { transform = "logit(0, 1)", median = 0.5, sd = 0.7 }
[[parameters]]
name = "initial:p"
prior = { transform = "linear", median_from = "pressure", sd = 10.0 }
[[records]]
name = "one"
file = "one.csv"
inputs = { flow = "flow" }
channels = [ { column = "pressure", output = "pressure", noise = 2.0 } ]
train = [0.0, 1.5]
every = 4
[[records]]
name = "two"
file = "two.csv"
inputs = { flow = "one.csv:flow" }
channels = [ { column = "pressure", output = "pressure", noise = 3.0 } ]
train = [0.5, 1.5]
[[records]]
name = "three"
file = "three.csv"
inputs = { flow = "flow" }
channels = [ { column = "pressure", output = "pressure", noise = 2.0 } ]
use = "held-out"
"#;

fn aorta_study() -> Study {
    let files =
        [("one.csv", aorta(0.0, 1.51)), ("two.csv", aorta(10.0, 1.51)), ("three.csv", aorta(20.0, 0.01))];
    load(AORTA, &files)
}

#[test]
fn parameters_expand_over_the_trained_records() {
    let study = aorta_study();
    let names: Vec<&str> = study.theta.iter().map(|t| t.name.as_str()).collect();
    assert_eq!(names, ["R[one]", "R[two]", "C", "Zc", "initial:p[one]", "initial:p[two]"]);
    assert_eq!(study.setup.parameters, ["R", "C", "Zc", "initial:p"]);
    assert_eq!(study.setup.outputs, ["pressure"]);
    let prior: Vec<(f64, f64)> = study.theta.iter().map(|t| (t.prior_mean, t.prior_sd)).collect();
    assert_eq!(prior[0], (3f64.ln(), 2f64.ln()));
    assert_eq!(prior[2], (1.0, 2.0), "log2 counts octaves");
    assert_eq!(prior[3], (0.0, 0.7), "the middle of a logit is zero");
    assert_eq!(
        (prior[4], prior[5]),
        ((90.0, 10.0), (102.8224, 10.0)),
        "each record starts at its own first training pressure"
    );
    assert_eq!(study.theta[2].drift, Drift::Forgetting(0.98));
    assert_eq!(study.theta[3].transform, Transform::Logit { lo: 0.0, hi: 1.0 });
    assert_eq!(study.estimator.points, Points::Simplex);
    assert_eq!((study.estimator.passes, study.fleet.workers, study.seed), (2, 2, 1));
    assert_eq!(study.parameters[0].unit, "mmHg s/mL", "the model's unit where the study gives none");
    assert!(study.warnings.iter().any(|w| w.contains("`Zc` is given in kPa s/mL")), "{:?}", study.warnings);
}

#[test]
fn a_held_out_record_takes_the_mean_of_the_others_and_its_own_start() {
    let study = aorta_study();
    let theta = [1f64.ln(), 4f64.ln(), 3.0, 0.0, 91.0, 101.0];
    assert_eq!(study.theta_for(0, &theta), [1.0, 8.0, 0.5, 91.0]);
    assert_eq!(study.theta_for(1, &theta)[3], 101.0);
    let third = study.theta_for(2, &theta);
    // The geometric mean of 1 and 4, to rounding of exp and ln.
    assert!((third[0] - 2.0).abs() < 1e-14, "{third:?}");
    assert_eq!(third[3], 110.0, "its own first pressure");
}

#[test]
fn windows_hold_every_training_value_once_and_follow_each_other() {
    let study = aorta_study();
    let record = &study.records[0];
    let windows = study.windows(0);
    assert_eq!((windows[0].start, windows[0].times.as_slice()), (0.0, &[0.0][..]));
    assert!(windows[1..windows.len() - 1].iter().all(|w| w.times.len() == 4));
    for (before, after) in windows.iter().zip(&windows[1..]) {
        assert_eq!(after.start, *before.times.last().unwrap());
    }
    let times: Vec<f64> = windows.iter().flat_map(|w| w.times.clone()).collect();
    let observed: Vec<f64> = windows.iter().flat_map(|w| w.observed.clone()).collect();
    assert_eq!(times, record.times[..31], "0 to 1.5 by 0.05, both ends included");
    assert_eq!(observed, record.channels[0].values[..31]);
    let whole = study.whole(0, true);
    assert_eq!((whole.times, whole.observed), (times, observed));
}

#[test]
fn a_run_starts_at_the_first_row_even_when_training_starts_later() {
    let study = aorta_study();
    let windows = study.windows(1);
    assert_eq!((windows[0].start, windows[0].times.as_slice()), (0.0, &[0.5][..]));
    assert_eq!(windows.len(), 21);
    assert_eq!(study.whole(1, true).start, 0.0);
    assert!(study.windows(2).is_empty() && study.whole(2, true).times.is_empty());
    let free = study.whole(2, false);
    assert_eq!(free.times.len(), 60);
    assert!(free.observed.iter().all(|v| v.is_nan()));
}

#[test]
fn consecutive_windows_run_like_the_whole() {
    let study = aorta_study();
    let model = study.setup.build().unwrap();
    let theta = study.theta_for(0, &study.theta.iter().map(|t| t.prior_mean).collect::<Vec<_>>());
    let run = |window: Arc<Window>, state: Option<Vec<f64>>| {
        model.run(&Job { particle: 0, record: 0, window, theta: theta.clone(), state }).unwrap()
    };
    let whole = run(Arc::new(study.whole(0, true)), None);
    let mut state = None;
    let mut outputs = Vec::new();
    for window in study.windows(0) {
        let prediction = run(window, state.take());
        outputs.extend(prediction.outputs);
        state = Some(prediction.state);
    }
    // The inputs are cut to each window without changing a bit of what the model sees.
    assert_eq!(outputs, whole.outputs);
}

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

#[test]
fn held_out_values_are_in_no_window() {
    for every in [1, 7, 1000] {
        let text = SPRING.replace("train = ", &format!("every = {every}\ntrain = "));
        let study = load(&text, &[("swing.csv", swing(SECRET))]);
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
    let aorta = aorta_study();
    let windows = (0..3).flat_map(|record| aorta.windows(record));
    assert!(windows.flat_map(|w| w.observed.clone()).all(|v| v < SECRET));
}

#[test]
fn automatic_noise_comes_from_the_training_rows_alone_and_is_told() {
    let study = load(SPRING, &[("swing.csv", swing(SECRET))]);
    let noise = study.records[0].channels[0].noise;
    // 588 overlapping differences know the sd to about 5 %.
    assert!((noise / 0.02 - 1.0).abs() < 0.15, "{noise}");
    assert_eq!(load(SPRING, &[("swing.csv", swing(-3.0))]).records[0].channels[0].noise, noise);
    assert!(study.warnings.iter().any(|w| w.contains("noise of `position`")), "{:?}", study.warnings);
    assert_eq!(study.noise(0), [noise, 0.1]);
    assert!(study.records[0].channels[1].held_out);
}

#[test]
fn equations_keep_the_order_of_their_terms_and_their_initial_expressions() {
    let study = load(SPRING, &[("swing.csv", swing(0.0))]);
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
    let study = load(&format!("{SPRING}{effect}"), &[("swing.csv", swing(0.0))]);
    assert!(study.setup.effects.is_empty());
    assert_eq!(study.candidates[0].name, "stiffening");
    let parameter = "[[parameters]]\nname = \"q\"\nprior = { transform = \"log\", median = 1, factor = 2 }\n";
    let study = load(&format!("{SPRING}{effect}{parameter}"), &[("swing.csv", swing(0.0))]);
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
    let study = load(&study, &[("swing.csv", swing(0.0))]);
    let windows = study.windows(0);
    let last = windows.last().unwrap();
    assert!(study.delays);
    assert_eq!(last.inputs[0].times[0], 0.0);
}
