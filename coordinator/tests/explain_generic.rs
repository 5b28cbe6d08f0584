//! Terms of no field, for models whose states have no role, and families of candidates that a study leaves out.
#![allow(missing_docs, clippy::unwrap_used)]

mod reactor_kit;
mod study_kit;

use reactor_kit::{NOISE, explained, reactor, recorded};
use starlings_coordinator::explain::{Options, candidates};
use study_kit::Case;

#[test]
fn states_without_a_role_yield_a_term_by_its_form_and_no_error_of_a_sensor() {
    for (span, train, held_out) in
        [(25.0, 25.0, "biomass"), (25.0, 25.0, "substrate"), (25.0, 25.0, "product"), (15.0, 10.5, "product")]
    {
        let study = reactor(NOISE, train, held_out, false);
        let found = explained(&Case::new(&study, &[("batch.csv", recorded(NOISE, span, 0.05))])).unwrap();
        let said = &found.headline;
        let names: Vec<&str> = found.effects.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names, ["loss:X"], "{held_out}: {said}");
        assert_eq!(found.effects[0].says, "A loss of X in proportion to X.");
        let sensor = found.tied_with.iter().flatten().any(|name| name.starts_with("sensor"));
        assert!(!sensor, "{held_out}: {said}");
        // It dies at 0.05 per hour.
        let rate = &found.effects[0].parameters[0];
        assert!((rate.estimate - 0.05).abs() < 4.0 * rate.sd, "{held_out}: {rate:?}");
    }
}

#[test]
fn a_family_is_left_out_by_its_name() {
    let case =
        Case::new(&reactor(NOISE, 25.0, "biomass", true), &[("batch.csv", recorded(NOISE, 25.0, 0.05))]);
    let of = |without: &[&str]| -> Vec<String> {
        let options = Options {
            without: without.iter().map(|name| (*name).to_owned()).collect(),
            ..Options::default()
        };
        candidates(&case.study(), &options).unwrap().into_iter().map(|effect| effect.name).collect()
    };
    let all = of(&[]);
    assert!(
        all.iter().any(|n| n == "self-limit:X") && all.iter().any(|n| n == "sensor-gain:substrate"),
        "{all:?}"
    );
    assert!(!all.iter().any(|n| n == "loss:X"), "it is tried under the name that the study gives: {all:?}");
    assert_eq!(of(&["sensors", "generic"]), ["death"]);
}
