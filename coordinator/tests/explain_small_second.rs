//! A second effect that is small beside the first, and all that this leaves.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod rig_kit;
mod study_kit;

use explained_kit::{explained, noisy};
use rig_kit::rig;
use starlings_coordinator::explain::{Explanation, Verdict};
use study_kit::{Case, csv, grid, normals};

/// The rig, seen by a potentiometer and a velocimeter.
fn rig_study() -> String {
    rig(
        "{ name = \"pot\", unit = \"m\", value = \"x\" }, { name = \"vel\", unit = \"m/s\", value = \"v\" }",
        "{ column = \"pot\", output = \"pot\", noise = 0.0008 }, { column = \"vel\", output = \"vel\", noise = 0.01 }",
        "",
    )
}

/// A stop beyond a clearance of 45 mm.
const STOP: &str = r#"
[[effects]]
name = "stop"
says = "A stop on both sides."
adds = [ { to = "v", term = "-b*(x - max(min(x, 0.045), -0.045))" } ]
parameters = [ { name = "b", unit = "1/s^2", range = [0, 1000] } ]
"#;

/// What is found in a recording with a stop in it, whose potentiometer moves away by `drift` metres a second.
fn found_with(drift: f64) -> Explanation {
    let times = grid(1200, 0.01);
    let sweep = |t: &f64| {
        let envelope = 0.4 + 0.6 * (std::f64::consts::PI * t / 12.0).sin();
        3.2 * envelope * (std::f64::consts::TAU * (0.8 + 0.07 * t) * t).sin()
    };
    let push: Vec<f64> = times.iter().map(sweep).collect();
    let recording = |pot: &[f64], vel: &[f64]| csv("time,pot,vel,push", &[&times, pot, vel, &push]);
    let blank = vec![0.0; times.len()];
    let truth = Case::new(&format!("{}{STOP}", rig_study()), &[("rig.csv", recording(&blank, &blank))]);
    let of = |column, sd| noisy(&truth, &[], ("stop", 400.0), column, sd);
    let pot: Vec<f64> = of("pot", 0.0008).iter().zip(&times).map(|(x, t)| x + drift * t).collect();
    // Each channel has a noise of its own.
    let vel: Vec<f64> =
        of("vel", 0.0).iter().zip(normals(times.len(), 6)).map(|(v, e)| v + 0.01 * e).collect();
    explained(&Case::new(&rig_study(), &[("rig.csv", recording(&pot, &vel))])).unwrap()
}

#[test]
fn a_second_effect_that_settles_all_that_the_first_leaves_is_named_with_it_however_small() {
    let found = found_with(0.0006);
    let names: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
    assert_eq!(
        (found.verdict, names),
        (Verdict::Named, vec!["dead-zone", "sensor-drift:pot"]),
        "{}",
        found.headline
    );
    let drift = &found.effects[1].parameters[0];
    assert!((drift.estimate - 0.0006).abs() < 4.0 * drift.sd, "{drift:?}");
    let left = found.probabilities.as_ref().unwrap().discrepancy;
    assert!(left < 0.01, "{left}");
}

#[test]
fn without_it_the_first_is_named_alone() {
    let found = found_with(0.0);
    let names: Vec<&str> = found.effects.iter().map(|effect| effect.name.as_str()).collect();
    assert_eq!((found.verdict, names), (Verdict::Named, vec!["dead-zone"]), "{}", found.headline);
}
