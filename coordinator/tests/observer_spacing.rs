//! The reported effect of an observer on the state: corrected at the spacing at which the fit itself was.
#![allow(clippy::unwrap_used)]
mod study_kit;

use std::fmt::Write as _;

use study_kit::fleets::{At, Failing};
use study_kit::{Case, Done, run_once};

const STUDY: &str = r#"
[study]
name = "spacing"
[model]
kind = "windkessel-2"
constants = { C = 1.5, "initial:p" = 60 }
[[parameters]]
name = "R"
prior = { transform = "log", median = 1.0, factor = 1.5 }
[observer]
kind = "nudging"
gain = 3.0
# Runs of whole records, which decide whether more passes are needed, look like the one that is failed here.
[estimator]
passes = 2
[[records]]
name = "beats"
file = "pressure.csv"
inputs = { flow = "flow.csv:flow" }
channels = [ { column = "pressure", output = "pressure", noise = 1.0 } ]
"#;

/// Steps of 10 ms.
const STEPS: u32 = 200;

/// The pressure at every tenth step, with or without the empty rows between.
fn fit(empty_rows: bool) -> Done {
    case(empty_rows).run()
}

fn case(empty_rows: bool) -> Case {
    Case::new(STUDY, &files(empty_rows))
}

fn files(empty_rows: bool) -> [(&'static str, String); 2] {
    let (mut flow, mut pressure) = ("time,flow\n".to_owned(), "time,pressure\n".to_owned());
    for i in 0..=STEPS {
        let t = 0.01 * f64::from(i);
        writeln!(flow, "{t:?},{:?}", 90.0 + 40.0 * (6.0 * t).sin()).unwrap();
        if i % 10 == 0 {
            writeln!(pressure, "{t:?},{:?}", 95.0 + 6.0 * (6.0 * t).cos()).unwrap();
        } else if empty_rows {
            writeln!(pressure, "{t:?},").unwrap();
        }
    }
    [("flow.csv", flow), ("pressure.csv", pressure)]
}

#[test]
fn rows_without_a_value_do_not_weaken_the_observer() {
    let (thin, empty) = (fit(false), fit(true));
    let (of_thin, of_empty) = (thin.summary.observer.unwrap(), empty.summary.observer.unwrap());
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    // The same exact steps, cut at other places by the free run alone: rounding.
    assert!(close(of_thin.innovation_rms_with, of_empty.innovation_rms_with), "{of_thin:?} {of_empty:?}");
    assert!(close(of_thin.innovation_rms_without, of_empty.innovation_rms_without));
    // Ten times weaker the observer would leave most of the wrong start.
    assert!(of_thin.innovation_rms_with < 0.9 * of_thin.innovation_rms_without, "{of_thin:?}");
}

#[test]
fn a_model_that_fails_under_its_observer_at_the_estimate_is_told_in_the_summary() {
    // The run with the observer alone covers the whole record with data in it; the free run has none.
    let with_observer = |at: &At<'_>| {
        let window = &at.job.window;
        at.retried && window.times.len() > 10 && window.observed.iter().any(|v| v.is_finite())
    };
    let mut fleet = Failing::new(with_observer);
    let done = case(false).run_on(&mut fleet).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(fleet.failed, 1, "the comparison, and nothing of the fit");
    assert_eq!(done.summary.observer, None);
    let told = "the model fails under the observer `nudging` on record `beats`";
    assert!(done.warns(told) && done.warns("made to fail"), "{:?}", done.summary.warnings);
    assert!(!fit(false).warns(told));
}

#[test]
fn a_record_on_which_the_model_fails_under_its_observer_is_left_out_by_name_and_the_others_are_compared() {
    let second = STUDY.split("[[records]]").nth(1).unwrap().replace("\"beats\"", "\"more\"");
    let study = format!("{STUDY}[[records]]{second}");
    let both = Case::new(&study, &files(false));
    let on_the_second = |at: &At<'_>| {
        let window = &at.job.window;
        at.job.record == 1 && window.times.len() > 10 && window.observed.iter().any(|v| v.is_finite())
    };
    let mut fleet = Failing::new(on_the_second);
    let done = both.run_on(&mut fleet).unwrap_or_else(|error| panic!("{error}"));
    assert!(done.summary.observer.is_some(), "the first record is compared");
    for told in
        ["fails under the observer `nudging` on record `more`", "leave that record out", "the constants"]
    {
        assert!(done.warns(told), "{told}: {:?}", done.summary.warnings);
    }
    assert!(!done.warns("on record `beats`"));
}

const RATES: &str = r#"
[study]
name = "rates"
[model]
kind = "equations"
outputs = [ { name = "dense", value = "x" }, { name = "sparse", value = "y" } ]
[[model.states]]
name = "x"
initial = 1.0
rate = "a"
[[model.states]]
name = "y"
initial = 1.0
rate = "a"
[[parameters]]
name = "a"
prior = { transform = "linear", median = 0.0, sd = 1e-9 }
[observer]
kind = "nudging"
gain = 3.0
corrects = { dense = "x", sparse = "y" }
[estimator]
passes = 1
[[records]]
name = "both"
file = "both.csv"
channels = [ { column = "dense", output = "dense", noise = 1.0 }, { column = "sparse", output = "sparse", noise = 1.0 } ]
"#;

#[test]
fn a_sparse_channel_corrects_for_the_time_since_its_own_last_value() {
    // Both states begin at one and the data say zero: de/dt = −γ e, whatever the spacing.
    let mut file = "time,dense,sparse\n".to_owned();
    for i in 0..=100 {
        let sparse = if i % 10 == 0 { "0" } else { "" };
        writeln!(file, "{:?},0,{sparse}", 0.01 * f64::from(i)).unwrap();
    }
    let done = run_once(RATES, &[("both.csv", file)]);
    let left = |t: f64, spacing: f64| (-3.0 * (t - spacing).max(0.0)).exp();
    let (mut sparse, mut square) = (0, 0.0);
    for row in done.table("innovations", "output, time, innovation") {
        let (t, innovation): (f64, f64) = (row[1].parse().unwrap(), row[2].parse().unwrap());
        // A prediction follows the corrections of all earlier values of its channel, the first of which has no length.
        let wanted = left(t, if row[0] == "sparse" { 0.1 } else { 0.01 });
        // The parameter is free by 1e-9.
        assert!((innovation + wanted).abs() < 1e-7, "{} at {t}: {innovation} for {wanted}", row[0]);
        sparse += usize::from(row[0] == "sparse");
        square += wanted * wanted;
    }
    assert_eq!(sparse, 11);
    // A run of the whole record is corrected as the filter's windows are.
    let whole = done.summary.observer.unwrap().innovation_rms_with;
    assert!((whole / (square / 112.0_f64).sqrt() - 1.0).abs() < 1e-7, "{whole}");
}
