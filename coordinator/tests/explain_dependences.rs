//! Dependences that a model without roles lacks, alone, in pairs, and where the model as it is fits far from where it was meant.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod study_kit;

use explained_kit::{displayed, explained, noisy};
use starlings_coordinator::explain::Explanation;
use study_kit::{Case, csv, grid};

/// Names of what is told.
fn told(found: &Explanation) -> Vec<&str> {
    let mut names: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
    names.sort_unstable();
    names
}

/// Hares and lynxes of which the lynxes only die (Lotka 1925 without their food).
const LYNXES: &str = r#"
[study]
name = "lynxes"
seed = 1
time_unit = "yr"

[model]
kind = "equations"
outputs = [ { name = "hares", value = "H" }, { name = "lynxes", value = "L" } ]

[[model.states]]
name = "H"
initial = 30.0
rate = "a*H - b*H*L"

[[model.states]]
name = "L"
initial = 4.0
rate = "-d*L"

[[parameters]]
name = "a"
unit = "1/yr"
prior = { transform = "log", median = 0.5, factor = 2.0 }

[[parameters]]
name = "b"
unit = "1/yr"
prior = { transform = "log", median = 0.03, factor = 2.0 }

[[parameters]]
name = "d"
unit = "1/yr"
prior = { transform = "log", median = 0.8, factor = 2.0 }

[[parameters]]
name = "initial:H"
prior = { transform = "log", median = 30.0, factor = 1.3 }

[[parameters]]
name = "initial:L"
prior = { transform = "log", median = 4.0, factor = 1.3 }

[[records]]
name = "hudson"
file = "pelts.csv"
time = "year"
channels = [
  { column = "hares", output = "hares", noise = 5.0 },
  { column = "lynxes", output = "lynxes", noise = 4.0 },
]
"#;

/// Pelts of the Hudson Bay Company from 1900 to 1920, in thousands (Hewitt 1921, The Conservation of the Wild Life of Canada).
const HARES: [f64; 21] = [
    30.0, 47.2, 70.2, 77.4, 36.3, 20.6, 18.1, 21.4, 22.0, 25.4, 27.1, 40.3, 57.0, 76.6, 52.3, 19.5, 11.2,
    7.6, 14.6, 16.2, 24.7,
];
const PELTS_OF_LYNXES: [f64; 21] = [
    4.0, 6.1, 9.8, 35.2, 59.4, 41.7, 19.0, 13.0, 8.3, 9.1, 7.4, 8.0, 12.3, 19.5, 45.7, 51.1, 29.7, 15.8, 9.7,
    10.1, 8.6,
];

#[test]
fn what_is_missing_is_found_where_the_model_as_it_is_fits_far_from_its_priors() {
    let recording = csv("year,hares,lynxes", &[&grid(21, 1.0), &HARES, &PELTS_OF_LYNXES]);
    let found = explained(&Case::new(LYNXES, &[("pelts.csv", recording)])).unwrap();
    assert!(found.warnings.iter().any(|w| w.contains("far from its priors")), "{:?}", found.warnings);
    assert_eq!(told(&found), ["interaction:L:H"], "{}", found.headline);
    // Two cycles that are followed: at most the scatter that was stated.
    assert!(found.gap.iter().all(|gap| gap.after < 1.2 * gap.noise), "{:?}", found.gap);
}

/// A turns into B, and nothing else happens.
const REACTION: &str = r#"
[study]
name = "reaction"
seed = 1
time_unit = "min"

[model]
kind = "equations"
outputs = [ { name = "first", unit = "mM", value = "A" }, { name = "second", unit = "mM", value = "B" } ]

[[model.states]]
name = "A"
unit = "mM"
initial = 10.0
rate = "-k*A"

[[model.states]]
name = "B"
unit = "mM"
initial = 1.0
rate = "k*A"

[[parameters]]
name = "k"
unit = "1/min"
prior = { transform = "log", median = 0.05, factor = 3.0 }

[[records]]
name = "flask"
file = "flask.csv"
channels = [
  { column = "first", output = "first", noise = 0.1 },
  { column = "second", output = "second", noise = 0.1 },
]
train = [0.0, 40.0]
"#;

/// B turns back into A, and more of it is lost.
const BACK: &str = r#"
[[effects]]
name = "back"
says = "B turns back, and is lost."
adds = [ { to = "A", term = "b*B" }, { to = "B", term = "-1.25*b*B" } ]
parameters = [ { name = "b", unit = "1/min", range = [0, 1] } ]
"#;

#[test]
fn two_dependences_that_are_missing_together_are_named_together() {
    let times = grid(61, 1.0);
    let ones = vec![1.0; times.len()];
    let blank = csv("time,first,second", &[&times, &ones, &ones]);
    let truth = Case::new(&format!("{REACTION}{BACK}"), &[("flask.csv", blank)]);
    let of = |column: &str| noisy(&truth, &[("k", 0.12)], ("back", 0.08), column, 0.1);
    let recording = csv("time,first,second", &[&times, &of("first"), &of("second")]);
    let found = explained(&Case::new(REACTION, &[("flask.csv", recording)])).unwrap();
    assert_eq!(told(&found), ["coupling:A:B", "loss:B"], "{}", found.headline);
}

/// A car on a road whose slope is known and left out.
const CAR: &str = r#"
[study]
name = "car"
seed = 1
time_unit = "s"

[model]
kind = "equations"
outputs = [ { name = "speed", unit = "m/s", value = "v" } ]
inputs = [ { name = "force", unit = "N" }, { name = "slope" } ]

[[model.states]]
name = "v"
unit = "m/s"
initial = 12
rate = "force/m - c0 - c2*v^2"

[[parameters]]
name = "m"
unit = "kg"
prior = { transform = "log", median = 1200.0, factor = 1.5 }

[[parameters]]
name = "c0"
unit = "m/s^2"
prior = { transform = "log", median = 0.1, factor = 2.0 }

[[parameters]]
name = "c2"
unit = "1/m"
prior = { transform = "log", median = 0.001, factor = 3.0 }

[[parameters]]
name = "initial:v"
unit = "m/s"
prior = { transform = "linear", median = 12.0, sd = 1.0 }

[[records]]
name = "road"
file = "road.csv"
inputs = { force = "force", slope = "slope" }
channels = [ { column = "speed", output = "speed", noise = 0.12 } ]
train = [0.0, 200.0]
"#;

/// The weight along the road.
const WEIGHT: &str = r#"
[[effects]]
name = "weight"
says = "The weight pulls downhill."
adds = [ { to = "v", term = "-g*slope" } ]
parameters = [ { name = "g", unit = "m/s^2", range = [0, 20] } ]
"#;

#[test]
fn what_leaves_more_than_noise_is_not_named_before_a_dependence_was_tried() {
    let times = grid(301, 1.0);
    let wave = |period: f64, phase: f64| move |t: &f64| (std::f64::consts::TAU * t / period + phase).sin();
    let pull = |t: &f64| 900.0 + 500.0 * wave(120.0, 0.0)(t) + 300.0 * wave(61.0, 0.0)(t).signum();
    let force: Vec<f64> = times.iter().map(|t| pull(t).max(0.0)).collect();
    let slope: Vec<f64> =
        times.iter().map(|t| 0.03 * wave(83.0, 0.0)(t) + 0.02 * wave(37.0, 1.0)(t)).collect();
    let recording = |speed: &[f64]| csv("time,force,slope,speed", &[&times, &force, &slope, speed]);
    let truth = Case::new(&format!("{CAR}{WEIGHT}"), &[("road.csv", recording(&vec![12.0; times.len()]))]);
    let clean =
        noisy(&truth, &[("m", 1400.0), ("c0", 0.118), ("c2", 0.00042)], ("weight", 9.81), "speed", 0.0);
    let speed = displayed(&clean, 0.12, 0.1, 5);
    let found = explained(&Case::new(CAR, &[("road.csv", recording(&speed))])).unwrap();
    assert_eq!(told(&found), ["coupling:v:slope"], "{}", found.headline);
}

/// A substance in the blood that is only excreted.
const TRACER: &str = r#"
[study]
name = "tracer"
seed = 1
time_unit = "h"

[model]
kind = "equations"
outputs = [ { name = "blood", unit = "mg/L", value = "c" } ]

[[model.states]]
name = "c"
unit = "mg/L"
initial = "dose"
rate = "-k*c"

[[parameters]]
name = "k"
unit = "1/h"
prior = { transform = "log", median = 0.3, factor = 2.0 }

[[parameters]]
name = "dose"
unit = "mg/L"
prior = { transform = "log", median = 10.0, factor = 1.5 }

[[records]]
name = "dog"
file = "dog.csv"
channels = [ { column = "blood", output = "blood", noise = 0.03 } ]
"#;

/// It goes into the tissue as well, and comes back.
const TISSUE: &str = r#"
[[effects]]
name = "tissue"
says = "The tissue takes it up and gives it back."
states = [ { name = "tissue", unit = "mg/L", initial = "0", rate = "0.35*(c - tissue)" } ]
adds = [ { to = "c", term = "-k_tissue*(c - tissue)" } ]
parameters = [ { name = "k_tissue", unit = "1/h", range = [0, 10] } ]
"#;

#[test]
fn a_second_compartment_is_a_hidden_store_before_it_is_a_threshold() {
    let times = grid(73, 0.5);
    let blank = csv("time,blood", &[&times, &vec![1.0; times.len()]]);
    let truth = Case::new(&format!("{TRACER}{TISSUE}"), &[("dog.csv", blank)]);
    let blood = noisy(&truth, &[("k", 0.25), ("dose", 10.0)], ("tissue", 0.9), "blood", 0.03);
    let found = explained(&Case::new(TRACER, &[("dog.csv", csv("time,blood", &[&times, &blood]))])).unwrap();
    assert_eq!(told(&found), ["hidden-store"], "{}", found.headline);
}
