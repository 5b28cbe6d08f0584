//! `period` of a periodic start against what the inputs say: whole multiples of theirs are right, others are told.
#![allow(clippy::unwrap_used)]
mod study_kit;

use std::f64::consts::TAU;

use study_kit::{Case, csv, grid};

/// A store that is filled every 0.8 s, with more in `[model]`, and the inputs of its record.
fn study(model: &str, inputs: &str) -> String {
    let (declared, given, flow) = if inputs.is_empty() {
        ("", String::new(), "2")
    } else {
        ("inputs = [ { name = \"q\" } ]", format!("inputs = {{ q = \"{inputs}\" }}"), "q")
    };
    format!(
        r#"
[study]
name = "drip"
[model]
kind = "equations"
start = "periodic"
{model}
{declared}
outputs = [ {{ name = "pressure", value = "p" }} ]
[[model.states]]
name = "p"
initial = 0.0
rate = "{flow} - p/R"
[[parameters]]
name = "R"
prior = {{ transform = "log", median = 2.0, factor = 1.5 }}
[[records]]
name = "beats"
file = "beats.csv"
{given}
channels = [ {{ column = "p", output = "pressure", noise = 5.0 }} ]
"#
    )
}

fn case(model: &str, inputs: &str) -> Case {
    let times = grid(121, 0.02);
    let of = |f: &dyn Fn(f64) -> f64| times.iter().map(|t| f(*t)).collect::<Vec<f64>>();
    let (q, once) = (of(&|t| 2.0 + (TAU * t / 0.8).cos()), of(&|t| t * t));
    Case::new(
        &study(model, inputs),
        &[("beats.csv", csv("time,q,once,p", &[&times, &q, &once, &[4.0; 121]]))],
    )
}

#[test]
fn whole_multiples_of_the_period_of_the_inputs_are_right_and_what_lies_beside_them_is_warned_of() {
    for period in ["0.8", "1.6", "2.4", "0.805"] {
        let study = case(&format!("period = {period}"), "q").study();
        assert!(!study.warnings.iter().any(|w| w.contains("`period`")), "{period}: {:?}", study.warnings);
    }
    for period in ["0.82", "0.78"] {
        let study = case(&format!("period = {period}"), "q").study();
        let told = study.warnings.iter().find(|w| w.contains("is no whole multiple of 0.8")).unwrap();
        assert!(told.contains("Leave out `period`"), "{told}");
    }
}

#[test]
fn a_time_in_which_inputs_hardly_change_is_no_period() {
    for period in ["1e-9", "0.01", "0.02"] {
        let told = case(&format!("period = {period}"), "q").refusal().unwrap();
        assert!(
            told.contains("is far below that of record `beats`, whose inputs repeat every 0.8"),
            "{told}"
        );
        let told = case(&format!("period = {period}"), "once").refusal().unwrap();
        assert!(told.contains("its inputs have hardly changed by then"), "{told}");
    }
}

#[test]
fn a_model_without_inputs_is_told_to_have_none_in_which_a_period_would_be_found() {
    let told = case("", "").refusal().unwrap();
    assert!(told.contains("the model `equations` has no inputs, in which a period would be found"), "{told}");
    assert_eq!(case("period = 0.8", "").refusal(), None);
}
