//! Two observers of one kind: each has the outputs that `corrects` names, and what they disagree on is told by name.
#![allow(clippy::unwrap_used)]
mod study_kit;

use study_kit::{Case, csv, grid};

/// Two compartments of which each shows its pressure, under two observers.
fn study(outputs: [&str; 2], observers: &str) -> String {
    format!(
        r#"
[study]
name = "pair"
[model]
kind = "equations"
outputs = [ {{ name = "y1", value = "{}" }}, {{ name = "y2", value = "{}" }} ]
[[model.states]]
name = "p1"
initial = 70.0
rate = "-(p1 - p2)/R1"
[[model.states]]
name = "p2"
initial = 68.0
rate = "2*((p1 - p2)/R1 - p2)"
[[parameters]]
name = "R1"
prior = {{ transform = "log", median = 0.3, factor = 1.5 }}
{observers}
[[records]]
name = "one"
file = "pair.csv"
channels = [ {{ column = "y1", output = "y1", noise = 1.0 }}, {{ column = "y2", output = "y2", noise = 1.0 }} ]
"#,
        outputs[0], outputs[1]
    )
}

fn nudging(gain: f64, corrects: &str) -> String {
    format!("[[observer]]\nkind = \"nudging\"\ngain = {gain:?}\ncorrects = {{ {corrects} }}\n")
}

fn case(study: &str) -> Case {
    let times = grid(21, 0.01);
    Case::new(study, &[("pair.csv", csv("time,y1,y2", &[&times, &[70.0; 21], &[68.0; 21]]))])
}

#[test]
fn each_has_the_outputs_that_it_names_and_a_gain_of_its_own() {
    let observers = nudging(5.0, "y1 = \"p1\"") + &nudging(3.0, "y2 = \"p2\"");
    let case = case(&study(["p1", "p2"], &observers));
    assert_eq!(case.refusal(), None);
    let names = case.study().setup.observer.names();
    assert_eq!(names, ["nudging of y1", "nudging of y2"]);
}

#[test]
fn one_alone_keeps_the_pairs_of_the_model_that_it_does_not_name() {
    let alone = nudging(5.0, "y1 = \"p1\"").replace("[[observer]]", "[observer]");
    let study = case(&study(["p1", "p2"], &alone)).study();
    assert!(!study.setup.observer.named_only);
    assert_eq!(study.setup.observer.name(), "nudging");
}

#[test]
fn a_state_that_both_correct_is_told_with_the_outputs_of_each() {
    let observers = nudging(5.0, "y1 = \"p1\"") + &nudging(3.0, "y2 = \"p1\"");
    let told = case(&study(["p1", "2*p1"], &observers)).refusal().unwrap();
    assert!(
        told.contains("the observers `nudging` by `y1` and `nudging` by `y2` both correct the state `p1`"),
        "{told}"
    );
    assert!(told.contains("`corrects` names the outputs of each"), "{told}");
}

#[test]
fn a_pair_that_is_unstable_together_is_refused_with_the_factor_that_is_not() {
    let observers = nudging(20.0, "y1 = \"p1\"") + &nudging(12.0, "y2 = \"p2\"");
    let told = case(&study(["p1 + 3*p2", "3*p1 + p2"], &observers)).refusal().unwrap();
    assert!(
        told.contains("the observers `nudging of y1 + nudging of y2` are each stable and unstable together"),
        "{told}"
    );
    // The determinant of A − f Γ, 6.667 + 733.3 f − 1920 f², is zero at f = 0.39083.
    assert!(told.contains("the largest common factor that is stable is 0.39;"), "{told}");
}
