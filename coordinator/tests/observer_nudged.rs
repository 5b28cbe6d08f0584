//! Nudging by an output that is not one state: its gain is bounded where the study is read.
#![allow(clippy::unwrap_used)]
mod study_kit;

use study_kit::{Case, csv, grid};

/// A level x and another v, seen as `a * x + 3 * v` every 0.1 s, with `more` in the study.
fn study(corrects: &str, gain: f64, median: f64, more: &str) -> String {
    format!(
        r#"
[study]
name = "nudged"
[model]
kind = "equations"
outputs = [ {{ name = "sum", value = "a*x + 3*v" }}, {{ name = "turned", value = "-x" }} ]
[[model.states]]
name = "x"
initial = 1.0
rate = "-x"
[[model.states]]
name = "v"
initial = 0.5
rate = "-v"
[[parameters]]
name = "a"
prior = {{ transform = "linear", median = {median:?}, sd = 0.1 }}
[observer]
kind = "nudging"
gain = {gain:?}
corrects = {{ {corrects} }}
[[records]]
name = "one"
file = "sum.csv"
channels = [
  {{ column = "sum", output = "sum", noise = 0.1 }},
  {{ column = "turned", output = "turned", noise = 0.1 }},
]
{more}
"#
    )
}

fn told(study: &str) -> Option<String> {
    let times = grid(21, 0.1);
    Case::new(study, &[("sum.csv", csv("time,sum,turned", &[&times, &[1.0; 21], &[1.0; 21]]))]).refusal()
}

#[test]
fn the_gain_is_bounded_by_what_the_output_shows_of_the_state_at_the_prior_medians() {
    let told = |state: &str, gain, median| told(&study(&format!("sum = \"{state}\""), gain, median, ""));
    // h = 3: γΔt < ln 3, 10.986/s.
    assert_eq!(told("v", 10.9, 1.0), None);
    let unstable = told("v", 11.0, 1.0).unwrap();
    assert!(unstable.contains("a gain of 11 is unstable: the observer `nudging`"), "{unstable}");
    assert!(unstable.contains("the largest stable gain is 10.9861 1/s"), "{unstable}");
    // h is the parameter, 1 at its median or 4: ln 2.
    assert_eq!(told("x", 1e3, 1.0), None);
    let unstable = told("x", 7.0, 4.0).unwrap();
    assert!(unstable.contains("the largest stable gain is 6.9315 1/s"), "{unstable}");
    // An output that falls as its state rises.
    let away = told("x", 1e-3, -1.0).unwrap();
    assert!(away.contains("no gain is stable") && away.contains("the other sign"), "{away}");
}

#[test]
fn an_output_that_does_not_depend_on_the_state_that_it_corrects_is_refused() {
    let refused = told(&study("turned = \"v\"", 1.0, 1.0, "")).unwrap();
    assert!(
        refused.contains("the output `turned` does not depend on the state `v`, which it is to correct"),
        "{refused}"
    );
    assert!(refused.contains("leave it out of `corrects`"), "{refused}");
    // A square shows nothing at zero, where this run starts, a product nothing while its input is off, and a valve nothing while it is shut.
    for value in ["x^2", "x*(1 + t) - x", "max(x - 2, 0)"] {
        let square = study("turned = \"x\"", 1.0, 1.0, "").replace("\"-x\" }", &format!("\"{value}\" }}"));
        let told = told(&square.replace("initial = 1.0", "initial = 0.0")).unwrap_or_default();
        assert!(!told.contains("does not depend"), "{told}");
    }
}

#[test]
fn a_channel_that_is_held_out_corrects_nothing_and_bounds_nothing() {
    let both = "sum = \"x\", turned = \"x\"";
    // Their mean falls as x rises: (0.5 − 1)/2.
    let refused = told(&study(both, 1.0, 0.5, "")).unwrap();
    assert!(refused.contains("no gain is stable"), "{refused}");
    assert_eq!(told(&study(both, 1.0, 0.5, "[explain]\nhold_out_channels = [\"turned\"]\n")), None);
}
