//! What a study leaves to the units of its quantities, and a training span in another unit than its record.
#![allow(clippy::unwrap_used)]

mod study_kit;

use starlings_coordinator::study::Study;
use starlings_models::{BuildSetup, Quantity, Role};
use study_kit::{Case, csv, grid};

/// A ball that falls.
const BALL: &str = r#"
[study]
name = "ball"
seed = 1
[model]
kind = "equations"
inputs = [{ name = "push", unit = "N" }, { name = "room", unit = "degC", role = "other" }]
outputs = [{ name = "seen", value = "x" }]
[[model.states]]
name = "x"
unit = "m"
rate = "v"
[[model.states]]
name = "v"
unit = "m/s"
rate = "g + push + 0*room"
[[parameters]]
name = "g"
prior = { transform = "log", median = 9.8, factor = 1.1 }
[[records]]
name = "fall"
file = "fall.csv"
inputs = { push = "zero", room = "zero" }
channels = [{ column = "x", output = "seen", noise = 0.01 }]
"#;

fn ball(study: &str) -> Study {
    let counts = grid(20, 1.0);
    let squares: Vec<f64> = counts.iter().map(|k| k * k).collect();
    Case::new(study, &[("fall.csv", csv("time,x,zero", &[&counts, &squares, &[0.0; 20]]))]).study()
}

#[test]
fn a_training_span_that_ends_far_behind_its_record_is_told() {
    let told = |train: &str| {
        let study = ball(&BALL.replace("inputs = { push", &format!("train = {train}\ninputs = {{ push")));
        study.warnings.iter().any(|w| w.contains("`train` of record `fall` ends at"))
    };
    assert!(told("[0, 700]"), "milliseconds");
    assert!(!told("[0, 15]") && !told("[0, 20]"), "a sample behind the end");
    assert!(!told("[0, inf]"), "without an end");
}

#[test]
fn what_a_quantity_is_stands_in_its_unit_where_the_study_does_not_say_it() {
    let study = ball(BALL);
    let spec = study.setup.spec().unwrap();
    let roles = |list: &[Quantity]| list.iter().map(|q| q.role).collect::<Vec<Role>>();
    assert_eq!(roles(&spec.states), [Role::Displacement, Role::Velocity]);
    assert_eq!(roles(&spec.outputs), [Role::Displacement], "an output that is a state means what that means");
    assert_eq!(roles(&spec.inputs), [Role::Force, Role::Other]);
}
