//! What a solver lacks: effects on its inputs and outputs, and on the rates that it hosts.

use starlings_coordinator::explain::{Context, Explanation, Options, Verdict, explain};
use starlings_coordinator::study::Surroundings;
use starlings_coordinator::study::store::Store;

use crate::inside::{Inside, Place, threads};
use crate::swing::{native, recording, solver};

/// The explanation of a recording by a solver that takes terms on these states.
fn explained(data: &str, hosts: &[&str]) -> Explanation {
    let here = Place::new(&[("study.toml", &native("")), ("swing.csv", data)]);
    let there = Place::new(&[("study.toml", &solver("")), ("swing.csv", data)]);
    let inside = Inside::of(&here.load(&Surroundings::default()).unwrap(), hosts);
    let study = there.load(&inside.surroundings()).unwrap();
    let store = Store::create(&there.folder.path().join("run.db"), &[]).unwrap();
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let found = explain(&study, &mut threads(&inside), &store, &mut context, &Options::default());
    found.unwrap_or_else(|error| panic!("{error}")).explanation
}

fn assert_named(found: &Explanation, name: &str, amplitude: f64) {
    assert_eq!(found.verdict, Verdict::Named, "{}: {:#?}", found.headline, found.tied_with);
    assert_eq!(found.effects[0].name, name, "{}", found.headline);
    let first = &found.effects[0].parameters[0];
    // Five posterior sd: one draw of the noise.
    assert!((first.estimate - amplitude).abs() < 5.0 * first.sd, "{first:?}");
}

#[test]
fn an_offset_of_a_sensor_is_named_though_no_rate_is_open() {
    let found = explained(&recording(&[("sensor-offset:velocity", 0.15)], &[], 11), &[]);
    assert_named(&found, "sensor-offset:velocity", 0.15);
    let refused = found.rejected.iter().find(|r| r.name == "cubic-stiffness").unwrap();
    assert!(refused.reason.contains("the solver `swing` does not host"), "{refused:?}");
}

#[test]
fn an_input_that_is_recorded_too_small_is_named() {
    let found = explained(&recording(&[("input-gain", 0.2)], &[], 12), &[]);
    assert_named(&found, "input-gain", 0.2);
}

#[test]
fn a_term_that_the_solver_hosts_is_named() {
    let found = explained(&recording(&[("cubic-stiffness", 2.0)], &[], 13), &["v"]);
    assert_named(&found, "cubic-stiffness", 2.0);
}
