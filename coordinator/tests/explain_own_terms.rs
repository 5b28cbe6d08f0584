//! Effects that a study lists by itself: the instant of a step, an amplitude whose range ends far above it, forms that hardly differ.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod study_kit;

use explained_kit::{explained, noisy};
use starlings_coordinator::explain::{Explanation, Verdict};
use study_kit::{Case, csv, grid};

/// A mass on a spring that is shaken, seen by a potentiometer.
const RIG: &str = r#"
[study]
name = "rig"
seed = 1
time_unit = "s"

[explain]
library = "study"

[model]
kind = "equations"
outputs = [ { name = "pot", unit = "m", value = "x" } ]
inputs = [ { name = "push", unit = "m/s^2" } ]

[[model.states]]
name = "x"
unit = "m"
role = "displacement"
initial = 0.01
rate = { motion = "v" }

[[model.states]]
name = "v"
unit = "m/s"
role = "velocity"
initial = 0.0
rate = { push = "gain*push", spring = "-k*x", damping = "-c*v" }

[[parameters]]
name = "gain"
unit = "1"
prior = { transform = "log", median = 1.0, factor = 1.05 }

[[parameters]]
name = "k"
unit = "1/s^2"
prior = { transform = "log", median = 60.0, factor = 1.3 }

[[parameters]]
name = "c"
unit = "1/s"
prior = { transform = "log", median = 1.6, factor = 1.5 }

[[records]]
name = "rig"
file = "rig.csv"
inputs = { push = "push" }
channels = [ { column = "pot", output = "pot", noise = 0.0002 } ]
train = [0.0, 8.5]
"#;

fn push() -> (Vec<f64>, Vec<f64>) {
    let times = grid(800, 0.015);
    let sweep = |t: &f64| 3.0 * (std::f64::consts::TAU * (0.6 + 0.06 * t) * t).sin();
    let push = times.iter().map(sweep).collect();
    (times, push)
}

/// What is found with these effects in a recording `pot`.
fn found(effects: &str, pot: &[f64]) -> Explanation {
    let (times, push) = push();
    explained(&Case::new(
        &format!("{RIG}{effects}"),
        &[("rig.csv", csv("time,pot,push", &[&times, pot, &push]))],
    ))
    .unwrap()
}

/// A recording with this effect of this size.
fn recorded(effect: &str, values: &[(&str, f64)], (name, size): (&str, f64)) -> Vec<f64> {
    let (times, push) = push();
    let blank = vec![0.0; times.len()];
    let truth =
        Case::new(&format!("{RIG}{effect}"), &[("rig.csv", csv("time,pot,push", &[&times, &blank, &push]))]);
    noisy(&truth, values, (name, size), "pot", 0.0002)
}

fn names(found: &Explanation) -> Vec<&str> {
    found.effects.iter().map(|effect| effect.name.as_str()).collect()
}

#[test]
fn the_instant_of_a_step_is_found_without_a_grid() {
    let effect = r#"
[[effects]]
name = "slip"
says = "The potentiometer slips once."
adds = [ { to = "output:pot", term = "jump*step(t - t_slip)" } ]
parameters = [ { name = "jump", unit = "m" }, { name = "t_slip", unit = "s", range = [0, 12] } ]
"#;
    let (times, _) = push();
    // Nothing is missing in the equations, and the sensor slips by 4 mm between two samples.
    let clean = recorded(effect, &[("t_slip", 1.0)], ("slip", 0.0));
    let pot: Vec<f64> =
        clean.iter().zip(&times).map(|(x, t)| if *t > 3.231 { x + 0.004 } else { *x }).collect();
    let found = found(effect, &pot);
    assert_eq!((found.verdict, names(&found)), (Verdict::Named, vec!["slip"]), "{}", found.headline);
    let [jump, instant] = found.effects[0].parameters.as_slice() else { panic!("{:?}", found.effects) };
    assert!((jump.estimate - 0.004).abs() < 4.0 * jump.sd, "{jump:?}");
    assert!((instant.estimate - 3.231).abs() < 0.016, "{instant:?}");
}

#[test]
fn an_amplitude_may_end_far_above_what_it_is() {
    let with_end = |end: &str| {
        format!(
            r#"
[[effects]]
name = "rubbing"
says = "Dry friction."
adds = [ {{ to = "v", term = "-f*tanh(v/0.01)" }} ]
parameters = [ {{ name = "f", unit = "m/s^2", range = [0, {end}] }} ]
"#
        )
    };
    let pot = recorded(&with_end("inf"), &[], ("rubbing", 0.08));
    for end in ["inf", "1", "100"] {
        let found = found(&with_end(end), &pot);
        assert_eq!(
            (found.verdict, names(&found)),
            (Verdict::Named, vec!["rubbing"]),
            "{end}: {}",
            found.headline
        );
        let f = &found.effects[0].parameters[0];
        assert!((f.estimate - 0.08).abs() < 4.0 * f.sd, "{end}: {f:?}");
    }
}

#[test]
fn of_forms_that_hardly_differ_those_that_data_tell_apart_are_refitted() {
    let drag = |tenths: u32| {
        format!(
            r#"
[[effects]]
name = "drag-{tenths}"
says = "A drag with the power {tenths}/10 of the speed."
adds = [ {{ to = "v", term = "-d{tenths}*sign(v)*(10*abs(v))^{}" }} ]
parameters = [ {{ name = "d{tenths}", unit = "m/s^2", range = [0, inf] }} ]
"#,
            f64::from(tenths) / 10.0
        )
    };
    let all: String = (18..=34).map(drag).collect();
    let pot = recorded(&drag(26), &[], ("drag-26", 0.05));
    let found = found(&all, &pot);
    let told: Vec<String> =
        names(&found).into_iter().map(str::to_owned).chain(found.tied_with.concat()).collect();
    assert_eq!(told.first().map(String::as_str), Some("drag-26"), "{}", found.headline);
    println!("{} | {:?}", found.headline, found.tied_with);
    let is_near = |name: &String| ["drag-25", "drag-26", "drag-27"].contains(&name.as_str());
    assert!(told.iter().all(is_near), "{told:?}");
}
