//! Effects that a study lists by itself: the instant of a step, an amplitude whose range ends far above it, forms that hardly differ; and the step
//! of a sensor, which is sought where residuals jump.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod rig_kit;
mod study_kit;

use explained_kit::{explained, noisy};
use rig_kit::rig;
use starlings_coordinator::explain::{Explanation, Verdict};
use study_kit::{Case, csv, grid};

/// The rig, seen by a potentiometer, with these effects; `more` stands before the model.
fn study(effects: &str, more: &str) -> String {
    let of_pot = rig(
        "{ name = \"pot\", unit = \"m\", value = \"x\" }",
        "{ column = \"pot\", output = \"pot\", noise = 0.0002 }",
        more,
    );
    format!("{of_pot}{effects}")
}

/// Nothing is tried but what the study lists.
const ALONE: &str = "[explain]\nlibrary = \"study\"";

fn push() -> (Vec<f64>, Vec<f64>) {
    let times = grid(800, 0.015);
    let sweep = |t: &f64| 3.0 * (std::f64::consts::TAU * (0.6 + 0.06 * t) * t).sin();
    let push = times.iter().map(sweep).collect();
    (times, push)
}

/// What is found in a recording `pot`.
fn found(study: &str, pot: &[f64]) -> Explanation {
    let (times, push) = push();
    explained(&Case::new(study, &[("rig.csv", csv("time,pot,push", &[&times, pot, &push]))])).unwrap()
}

/// A recording with this effect of this size.
fn recorded(effect: &str, values: &[(&str, f64)], (name, size): (&str, f64)) -> Vec<f64> {
    let (times, push) = push();
    let blank = vec![0.0; times.len()];
    let truth = Case::new(&study(effect, ""), &[("rig.csv", csv("time,pot,push", &[&times, &blank, &push]))]);
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
    let found = found(&study(effect, ALONE), &pot);
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
        let found = found(&study(&with_end(end), ALONE), &pot);
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
    let found = found(&study(&all, ALONE), &pot);
    let told: Vec<String> =
        names(&found).into_iter().map(str::to_owned).chain(found.tied_with.concat()).collect();
    assert_eq!(told.first().map(String::as_str), Some("drag-26"), "{}", found.headline);
    let is_near = |name: &String| ["drag-25", "drag-26", "drag-27"].contains(&name.as_str());
    assert!(told.iter().all(is_near), "{told:?}");
}

#[test]
fn the_step_of_a_sensor_is_named_beside_what_is_missing_and_not_tried_where_nothing_jumps() {
    let rubbing = r#"
[[effects]]
name = "rubbing"
says = "Dry friction."
adds = [ { to = "v", term = "-f*tanh(v/0.01)" } ]
parameters = [ { name = "f", unit = "m/s^2", range = [0, inf] } ]
"#;
    let with = |size| recorded(rubbing, &[], ("rubbing", size));
    let step = |pot: &[f64]| {
        let found = found(&study("", ""), pot);
        let tried = found.screened.iter().filter(|of| of.name.starts_with("sensor-step")).count();
        let named: Vec<String> = names(&found).into_iter().map(str::to_owned).collect();
        (tried, named, found)
    };
    let (tried, named, whole) = step(&with(0.05));
    assert_eq!((tried, named), (0, vec!["coulomb-friction".to_owned()]), "{}", whole.headline);
    // Six standard deviations of the noise, a hundredth of the swing.
    let (times, _) = push();
    let pot: Vec<f64> =
        with(0.3).iter().zip(&times).map(|(x, t)| if *t > 3.231 { x + 0.0012 } else { *x }).collect();
    let (tried, mut named, found) = step(&pot);
    named.sort();
    assert_eq!(
        (tried, named),
        (1, vec!["coulomb-friction".to_owned(), "sensor-step".to_owned()]),
        "{}",
        found.headline
    );
    let jump = found.effects.iter().find(|effect| effect.name == "sensor-step").unwrap();
    let [size, instant] = jump.parameters.as_slice() else { panic!("{jump:?}") };
    assert!((size.estimate - 0.0012).abs() < 4.0 * size.sd, "{size:?}");
    assert!((instant.estimate - 3.231).abs() < 0.05, "{instant:?}");
}
