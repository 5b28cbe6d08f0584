//! Good studies of several records: what becomes of parameters and windows, and that held-out values stay unseen.
// Values that are copied or chosen exactly are compared exactly; the helpers of a test file are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

use std::fmt::Write as _;
use std::sync::Arc;

use starlings_coordinator::study::Study;
use starlings_estimators::{Drift, Points, Transform};
use starlings_models::units::rounded;
use starlings_models::{BuildSetup, Job, StateValues, Window};

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
    assert_eq!((study.estimator.passes, study.fleet.workers, study.seed), (None, 2, 1));
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
    let run = |window: Arc<Window>, state: Option<StateValues>| {
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

#[test]
fn values_of_held_out_records_and_spans_are_in_no_window() {
    let study = aorta_study();
    let seen: Vec<f64> =
        (0..3).flat_map(|record| study.windows(record)).flat_map(|w| w.observed.clone()).collect();
    // 31 training rows of the first record, 21 of the second, none of the third.
    assert_eq!(seen.len(), 31 + 21);
    assert!(seen.iter().all(|v| *v < SECRET));
}

/// A level that rises evenly, with errors that a generator of congruences makes.
fn rising(n: usize, seed: u64) -> String {
    let mut state = seed;
    let mut text = "time,level\n".to_owned();
    for i in 0..n {
        let mut sum = 0.0;
        for _ in 0..12 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
        }
        writeln!(text, "{i},{}", 0.1 * i as f64 + 0.05 * (sum - 6.0)).unwrap();
    }
    text
}

#[test]
fn short_records_share_the_noise_that_is_found_and_long_ones_keep_their_own() {
    let mut study = r#"
[study]
name = "levels"
seed = 1
[model]
kind = "equations"
outputs = [{ name = "level", unit = "m", value = "h" }]
[[model.states]]
name = "h"
unit = "m"
initial = 0.0
rate = "q"
[[parameters]]
name = "q"
prior = { transform = "log", median = 0.1, factor = 2.0 }
"#
    .to_owned();
    let names = ["a", "b", "c", "long", "unseen"];
    for name in names {
        let unseen = if name == "unseen" { "use = \"held-out\"\n" } else { "" };
        let channels = "channels = [{ column = \"level\", output = \"level\", noise = \"auto\" }]";
        write!(study, "[[records]]\nname = \"{name}\"\nfile = \"{name}.csv\"\n{unseen}{channels}\n").unwrap();
    }
    let length = |name: &str| if name == "long" { 400 } else { 15 };
    let files: Vec<(String, String)> = names
        .iter()
        .zip(1..)
        .map(|(name, seed)| (format!("{name}.csv"), rising(length(name), seed)))
        .collect();
    let files: Vec<(&str, String)> = files.iter().map(|(name, text)| (name.as_str(), text.clone())).collect();
    let study = load(&study, &files);
    let noise: Vec<f64> = study.records.iter().map(|record| record.channels[0].noise).collect();
    let how: Vec<&str> = study.records.iter().map(|record| record.channels[0].noise_how.as_str()).collect();
    // Four hundred samples and more: their median scatters by 7 %; four of these.
    assert!(noise.iter().all(|sd| (sd / 0.05 - 1.0).abs() < 0.28), "{noise:?}");
    assert_eq!((noise[0], noise[1]), (noise[2], noise[0]), "one noise for the short ones");
    assert_eq!(how[0], "from the third differences of the 445 samples of 4 records, pooled");
    assert_eq!(how[3], "from the third differences of its 400 samples");
    // What is held out tells nothing of the others, and takes their noise.
    assert_eq!(how[4], "from the third differences of the 460 samples of 5 records, pooled");
    let told: Vec<&String> = study.warnings.iter().filter(|w| w.contains("was not given")).collect();
    assert_eq!(told.len(), 1, "one for all records: {told:?}");
    let four = |sd: f64| rounded(sd, 4);
    let least = noise.iter().copied().fold(f64::INFINITY, f64::min);
    let most = noise.iter().copied().fold(0.0, f64::max);
    let range = format!("in 5 records was not given: {} m to {} m were found", four(least), four(most));
    assert!(told[0].contains(&range), "as they are pooled, {noise:?}: {told:?}");
}
