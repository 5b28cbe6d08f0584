//! The reported effect of an observer on the state: corrected at the spacing at which the fit itself was.
#![allow(clippy::unwrap_used)]
mod study_kit;

use std::fmt::Write as _;

use study_kit::fleets::{At, Failing};
use study_kit::{Case, Done};

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
    Case::new(STUDY, &[("flow.csv", flow), ("pressure.csv", pressure)])
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
