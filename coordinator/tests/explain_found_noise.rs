//! Recordings whose noise has a memory and was not stated: third differences find too little of it.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod reactor_kit;
mod study_kit;

use explained_kit::{displayed, explained};
use reactor_kit::{NOISE, measured, reactor};
use starlings_coordinator::explain::{Explanation, Verdict};
use study_kit::{Case, csv, grid};

/// Hours of the batch, and how many of them train.
const SPAN: [f64; 2] = [24.0, 16.0];

/// What is told of a batch in which cells die at this rate, with noise that has a memory, stated or not.
fn of_batch(kd: f64, is_stated: bool) -> Explanation {
    let recording = measured(SPAN[0], kd, |k, clean| displayed(clean, NOISE[k], 1e-3, 7 + k as u64));
    let study = reactor(NOISE, SPAN[1], "product", false);
    let unstated = |text: String, sd: f64| text.replace(&format!("noise = {sd}"), "noise = \"auto\"");
    let study = if is_stated { study } else { NOISE.into_iter().fold(study, unstated) };
    explained(&Case::new(&study, &[("batch.csv", recording)])).unwrap()
}

#[test]
fn a_noise_with_a_memory_that_nobody_stated_is_no_gap_and_told_with_its_size() {
    let found = of_batch(0.0, false);
    assert_eq!(found.verdict, Verdict::NoGap, "{}", found.headline);
    assert!(found.headline.starts_with("No gap that these data show: what the model leaves may be noise"));
    let channels: Vec<&str> = found.correlated_noise.iter().map(|of| of.channel.as_str()).collect();
    assert_eq!(channels, ["biomass", "substrate"]);
    for (of, sd) in found.correlated_noise.iter().zip(NOISE) {
        // 80 values, of which about a third are independent: the sd is known to a seventh.
        assert!((of.sd.unwrap() / sd - 1.0).abs() < 0.35, "{of:?}");
        let told = |warning: &&String| warning.contains("stands and falls") && warning.contains(&of.channel);
        assert!(found.warnings.iter().any(|warning| told(&warning)), "{:?}", found.warnings);
        // The noise beside the errors is the one that was searched in.
        let row = found.gap.iter().find(|row| row.channel == of.channel).unwrap();
        assert!((row.noise / of.sd.unwrap() - 1.0).abs() < 1e-12, "{row:?}");
    }
}

#[test]
fn what_is_missing_is_named_whether_the_noise_with_a_memory_was_stated_or_not() {
    for is_stated in [true, false] {
        let found = of_batch(0.03, is_stated);
        assert!(matches!(found.verdict, Verdict::Named | Verdict::Tie), "{}", found.headline);
        let names: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
        assert_eq!(names, ["loss:X"], "stated {is_stated}: {}", found.headline);
        let condition = "That is if the noise, whose size the study does not state, is correlated in time";
        assert_eq!(found.headline.contains(condition), !is_stated, "{}", found.headline);
    }
}

/// A converter whose coil has no resistance, beside the duty that it was given.
const CONVERTER: &str = r#"
[study]
name = "converter"
seed = 1
time_unit = "s"

[model]
kind = "equations"
outputs = [ { name = "current", unit = "A", value = "i" }, { name = "voltage", unit = "V", value = "v" } ]
inputs = [ { name = "duty" } ]
constants = { Vin = 24 }

[[model.states]]
name = "i"
unit = "A"
initial = 0
rate = "(duty*Vin - v)/L"

[[model.states]]
name = "v"
unit = "V"
initial = 0
rate = "(i - v/R)/C"

[[parameters]]
name = "L"
unit = "H"
prior = { transform = "log", median = 1e-4, factor = 3.0 }

[[parameters]]
name = "C"
unit = "F"
prior = { transform = "log", median = 1e-4, factor = 3.0 }

[[parameters]]
name = "R"
unit = "ohm"
prior = { transform = "log", median = 10, factor = 2.0 }

[[records]]
name = "scope"
file = "scope.csv"
channels = [
    { column = "current", output = "current", noise = "auto" },
    { column = "voltage", output = "voltage", noise = "auto" },
]
inputs = { duty = "duty" }
train = [0.0, 0.0025]
"#;

/// What an oscilloscope shows of it: the coil has a resistance, and the duty changes at once and not between two samples.
fn oscillogram() -> String {
    let times = grid(400, 1e-5);
    let duty = |t: f64| {
        if t < 0.99995e-3 {
            0.3
        } else if t < 2.19995e-3 {
            0.6
        } else {
            0.4
        }
    };
    let (mut i, mut v, mut current, mut voltage) = (0.0, 0.0, Vec::new(), Vec::new());
    for t in &times {
        current.push(i);
        voltage.push(v);
        for k in 0..100 {
            i += 1e-7 * (24.0 * duty(t + 1e-7 * f64::from(k)) - v - 0.35 * i) / 220e-6;
            v += 1e-7 * (i - v / 8.0) / 47e-6;
        }
    }
    let (current, voltage) = (displayed(&current, 0.03, 0.02, 1), displayed(&voltage, 0.06, 0.05, 2));
    let duty: Vec<f64> = times.iter().map(|t| duty(*t)).collect();
    csv("time,duty,current,voltage", &[&times, &duty, &current, &voltage])
}

#[test]
fn where_nothing_explains_the_gap_beside_a_larger_noise_either_that_is_not_assumed() {
    let found = explained(&Case::new(CONVERTER, &[("scope.csv", oscillogram())])).unwrap();
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.headline);
    assert_eq!(found.correlated_noise, [], "the noise is the one that was found: {}", found.headline);
    assert!(
        !found.warnings.iter().any(|warning| warning.contains("stands and falls")),
        "{:?}",
        found.warnings
    );
}
