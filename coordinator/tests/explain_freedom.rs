//! Models with more freedom than the data: rates of which only quotients show, and records of a dozen values.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod study_kit;

use explained_kit::{explained, noisy};
use starlings_coordinator::explain::Verdict;
use study_kit::{Case, csv, grid};

/// A heated room of which the data tell U/C and P/C alone.
const ROOM: &str = r#"
[study]
name = "room"
seed = 1
time_unit = "h"

[model]
kind = "equations"
outputs = [ { name = "air", unit = "degC", value = "T" } ]
inputs = [ { name = "outside", unit = "degC" }, { name = "heater", unit = "kW" } ]

[[model.states]]
name = "T"
unit = "degC"
initial = 17.0
rate = "(-U*(T - outside) + P*heater)/C"

[[parameters]]
name = "U"
prior = { transform = "log", median = 0.1, factor = 2.0 }

[[parameters]]
name = "P"
prior = { transform = "log", median = 1.0, factor = 2.0 }

[[parameters]]
name = "C"
prior = { transform = "log", median = 1.0, factor = 2.0 }

[[records]]
name = "week"
file = "week.csv"
time = "time"
inputs = { outside = "outside", heater = "heater" }
channels = [ { column = "air", output = "air", noise = 0.07 } ]
train = [0.0, 72.0]
"#;

/// A wall behind the air.
const WALL: &str = r#"
[[effects]]
name = "wall"
says = "A wall stores heat."
states = [ { name = "wall_T", unit = "degC", initial = "17", rate = "0.08*(T - wall_T)" } ]
adds = [ { to = "T", term = "-k_wall*(T - wall_T)" } ]
parameters = [ { name = "k_wall", unit = "1/h", range = [0, 10] } ]
"#;

#[test]
fn an_effect_is_found_in_a_model_whose_parameters_tell_quotients_only() {
    let times = grid(290, 0.5);
    let outside: Vec<f64> =
        times.iter().map(|t| 5.0 + 5.0 * (t / 24.0 * std::f64::consts::TAU).sin()).collect();
    let heater: Vec<f64> = times.iter().map(|t| if (t / 7.0) as u64 % 3 == 1 { 2.0 } else { 0.3 }).collect();
    let recording = |air: &[f64]| csv("time,outside,heater,air", &[&times, &outside, &heater, air]);
    let truth = Case::new(&format!("{ROOM}{WALL}"), &[("week.csv", recording(&vec![17.0; times.len()]))]);
    let noisy = noisy(&truth, &[("U", 0.35), ("P", 4.0), ("C", 1.0)], ("wall", 0.9), "air", 0.07);
    let found = explained(&Case::new(ROOM, &[("week.csv", recording(&noisy))])).unwrap();
    assert_eq!(found.verdict, Verdict::Named, "{}", found.headline);
    assert_eq!(found.effects[0].name, "second-store", "{}", found.headline);
    // Noise of 0.07 in some 150 values, and a model that is right.
    assert!((0.06..0.08).contains(&found.gap[0].after), "{:?}", found.gap);
}

/// Influenza in a boarding school of 763, pupils in bed by day (British Medical Journal 1978, 1, 587), by Kermack and McKendrick (1927).
const INFLUENZA: &str = r#"
[study]
name = "influenza"
seed = 1
time_unit = "d"

[model]
kind = "equations"
outputs = [ { name = "in_bed", value = "I" } ]
constants = { N = 763.0 }

[[model.states]]
name = "S"
initial = 762.0
rate = "-beta*S*I/N"

[[model.states]]
name = "I"
initial = "start"
rate = "beta*S*I/N - recovery*I"

[[parameters]]
name = "beta"
unit = "1/d"
prior = { transform = "log", median = 1.7, factor = 2.0 }

[[parameters]]
name = "start"
prior = { transform = "log", median = 2.0, factor = 2.0 }

[[parameters]]
name = "recovery"
unit = "1/d"
prior = { transform = "log", median = 0.4, factor = 2.0 }

[[records]]
name = "school"
file = "school.csv"
time = "day"
channels = [ { column = "in_bed", output = "in_bed", noise = 10.0 } ]
"#;

#[test]
fn two_errors_of_instruments_are_no_answer_where_nothing_being_missing_is_likelier() {
    let in_bed = [3.0, 8.0, 26.0, 76.0, 225.0, 298.0, 258.0, 233.0, 189.0, 128.0, 68.0, 29.0, 14.0, 4.0];
    let recording = csv("day,in_bed", &[&grid(in_bed.len(), 1.0), &in_bed]);
    let found = explained(&Case::new(INFLUENZA, &[("school.csv", recording)])).unwrap();
    assert!(found.effects.is_empty(), "{}", found.headline);
    let pair = found.rejected.iter().find(|r| r.name.contains(" + ")).unwrap();
    assert!(pair.reason.contains("nothing being missing stays likelier"), "{}", pair.reason);
}
