//! Recordings whose noise has a memory and was not stated: third differences find too little of it.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod study_kit;

use explained_kit::{displayed, explained, noisy};
use starlings_coordinator::explain::{Explanation, Verdict};
use study_kit::{Case, csv, grid};

/// Growth on a substrate, with a product that stays; `NOISE_X` and `NOISE_P` stand for the noise.
const BATCH: &str = r#"
[study]
name = "batch"
seed = 1
time_unit = "h"

[model]
kind = "equations"
outputs = [
    { name = "biomass", unit = "g/L", value = "X" },
    { name = "product", unit = "g/L", value = "P" },
]

[[model.states]]
name = "X"
unit = "g/L"
initial = 0.2
rate = "mu*(1 - X/5)*X"

[[model.states]]
name = "P"
unit = "g/L"
initial = 0.0
rate = "b*mu*(1 - X/5)*X"

[[parameters]]
name = "mu"
unit = "1/h"
prior = { transform = "log", median = 0.2, factor = 3.0 }

[[parameters]]
name = "b"
prior = { transform = "log", median = 0.5, factor = 3.0 }

[[records]]
name = "vessel"
file = "batch.csv"
channels = [
    { column = "biomass", output = "biomass", noise = NOISE_X },
    { column = "product", output = "product", noise = NOISE_P },
]
train = [0.0, 28.0]
"#;

/// The product decays.
const DECAY: &str = r#"
[[effects]]
name = "decay"
says = "The product decays."
adds = [ { to = "P", term = "-k*P" } ]
parameters = [ { name = "k", unit = "1/h", range = [0, 1] } ]
"#;

const SD: [f64; 2] = [0.05, 0.06];

/// What is told of a batch whose product decays at this rate, with noise that has a memory, stated or not.
fn of_batch(decay: f64, is_stated: bool) -> Explanation {
    let times = grid(81, 0.5);
    let recording = |x: &[f64], p: &[f64]| csv("time,biomass,product", &[&times, x, p]);
    let with = |noise: [String; 2], more: &str| {
        BATCH.replace("NOISE_X", &noise[0]).replace("NOISE_P", &noise[1]) + more
    };
    let (stated, zero) = (SD.map(|sd| sd.to_string()), vec![0.0; times.len()]);
    let truth = Case::new(&with(stated.clone(), DECAY), &[("batch.csv", recording(&zero, &zero))]);
    let clean = |column| noisy(&truth, &[("mu", 0.3), ("b", 0.9)], ("decay", decay), column, 0.0);
    let (x, p) =
        (displayed(&clean("biomass"), SD[0], 0.001, 7), displayed(&clean("product"), SD[1], 0.001, 8));
    let noise = if is_stated { stated } else { [0, 1].map(|_| "\"auto\"".to_owned()) };
    explained(&Case::new(&with(noise, ""), &[("batch.csv", recording(&x, &p))])).unwrap()
}

/// Whether what is told first is the decay, alone or tied.
fn tells_the_decay(found: &Explanation) -> bool {
    let names: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
    matches!(found.verdict, Verdict::Named | Verdict::Tie) && names == ["loss:P"]
}

#[test]
fn a_noise_with_a_memory_that_nobody_stated_is_no_gap_and_told_with_its_size() {
    let found = of_batch(0.0, false);
    assert_eq!(found.verdict, Verdict::NoGap, "{}", found.headline);
    assert!(found.headline.starts_with("No gap that these data show: what the model leaves may be noise"));
    for (of, sd) in found.correlated_noise.iter().zip(SD) {
        // 57 values, of which about a third are independent: the sd is known to a sixth.
        assert!((of.sd.unwrap() / sd - 1.0).abs() < 0.4, "{of:?}");
        let told = |warning: &&String| warning.contains("stands and falls") && warning.contains(&of.channel);
        assert!(found.warnings.iter().any(|warning| told(&warning)), "{:?}", found.warnings);
    }
    assert_eq!(found.correlated_noise.len(), 2);
}

#[test]
fn what_is_missing_is_named_whether_the_noise_with_a_memory_was_stated_or_not() {
    for is_stated in [true, false] {
        let found = of_batch(0.05, is_stated);
        assert!(tells_the_decay(&found), "stated {is_stated}: {}", found.headline);
        let condition = "That is if the noise, whose size the study does not state, is correlated in time";
        assert_eq!(found.headline.contains(condition), !is_stated, "{}", found.headline);
    }
}
