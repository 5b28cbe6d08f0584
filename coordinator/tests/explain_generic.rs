//! Terms of no field, for models whose states have no role, and families of candidates that a study leaves out.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod reactor_kit;
mod study_kit;

use explained_kit::{explained, noisy};
use reactor_kit::{NOISE, reactor, recorded};
use starlings_coordinator::explain::{Explanation, Kind, Options, Verdict, candidates};
use study_kit::{Case, csv, grid};

/// Swings from far out, by two states without a role.
const SWING: &str = r#"
[study]
name = "swing"
seed = 1

[model]
kind = "equations"
outputs = [ { name = "laser", unit = "m", role = "other", value = "x" } ]

[[model.states]]
name = "x"
unit = "m"
role = "other"
initial = 1.5
rate = "v"

[[model.states]]
name = "v"
unit = "m/s"
role = "other"
initial = 0.0
rate = "-k*x - c*v"

[[parameters]]
name = "k"
unit = "1/s^2"
prior = { transform = "log", median = 4.0, factor = 1.3 }

[[parameters]]
name = "c"
unit = "1/s"
prior = { transform = "log", median = 0.1, factor = 2.0 }

[[records]]
name = "swing"
file = "swing.csv"
time = "time"
channels = [ { column = "laser", output = "laser", noise = 0.01 } ]
train = [0.0, 15.0]
"#;

/// Damping that grows with the square of the deflection.
const DEFLECTION: &str = r#"
[[effects]]
name = "deflection"
says = "Damping that grows with the deflection."
adds = [ { to = "v", term = "-b*x^2*v" } ]
parameters = [ { name = "b", unit = "1/(m^2 s)", range = [0, 1] } ]
"#;

/// Damping with the cube of the velocity.
const STEEP: &str = r#"
[[effects]]
name = "steep"
says = "Damping with the cube of the velocity."
adds = [ { to = "v", term = "-b*v^3" } ]
parameters = [ { name = "b", unit = "s/m^2", range = [0, 1] } ]
"#;

/// Damping in proportion to the velocity.
const PLAIN: &str = r#"
[[effects]]
name = "plain"
says = "Damping in proportion to the velocity."
adds = [ { to = "v", term = "-b*v" } ]
parameters = [ { name = "b", unit = "1/s", range = [0, 1] } ]
"#;

/// True values of the parameters of the swing.
const SWINGS: [(&str, f64); 2] = [("k", 4.2), ("c", 0.08)];

/// What is found in a recording of a swing with this effect in it, of which the study knows nothing.
fn found_in(
    study: &str,
    effect: &str,
    (name, amplitude): (&str, f64),
    values: &[(&str, f64)],
) -> Explanation {
    let times = grid(400, 0.05);
    let blank = csv("time,laser", &[&times, &vec![1.0; times.len()]]);
    let truth = Case::new(&format!("{study}{effect}"), &[("swing.csv", blank)]);
    let noisy = noisy(&truth, values, (name, amplitude), "laser", 0.01);
    explained(&Case::new(study, &[("swing.csv", csv("time,laser", &[&times, &noisy]))])).unwrap()
}

/// The swing with the roles of its states and its output.
fn swing_with_roles() -> String {
    SWING
        .replace("unit = \"m\", role = \"other\"", "unit = \"m\", role = \"displacement\"")
        .replace("unit = \"m\"\nrole = \"other\"", "unit = \"m\"\nrole = \"displacement\"")
        .replace("unit = \"m/s\"\nrole = \"other\"", "unit = \"m/s\"\nrole = \"velocity\"")
}

#[test]
fn a_name_is_told_beside_the_form_that_the_data_do_not_tell_from_it() {
    let found = found_in(&swing_with_roles(), STEEP, ("steep", 0.005), &SWINGS);
    let said = &found.headline;
    assert_eq!(found.verdict, Verdict::Tie, "{said}");
    assert_eq!(
        (found.effects[0].name.as_str(), found.effects[0].kind),
        ("quadratic-drag", Kind::Library),
        "{said}"
    );
    assert!(found.tied_with.contains(&vec!["cube:v:v".to_owned()]), "{said}");
    assert!(
        said.contains("told first, since effects of the library are held likelier than proposals"),
        "{said}"
    );
}

#[test]
fn a_name_is_told_alone_where_other_forms_only_elaborate_it_or_lose() {
    // Without a damping of its own: a clamp of the velocity beyond all velocities, and dampings that lost the race, are no ties.
    let study = swing_with_roles();
    let (before, damping) = study.split_once("[[parameters]]\nname = \"c\"").unwrap();
    let after = &damping[damping.find("[[records]]").unwrap()..];
    let undamped = format!("{before}{after}").replace(" - c*v", "");
    let found = found_in(&undamped, PLAIN, ("plain", 0.2), &SWINGS[..1]);
    assert_eq!(found.effects[0].name, "viscous-friction", "{}", found.headline);
    let is_form = |name: &String| name.contains(':');
    assert!(!found.tied_with.iter().flatten().any(is_form), "{}", found.headline);
    let was_tried = |name: &str| found.screened.iter().any(|screened| screened.name == name);
    assert!(was_tried("clamped:v:v"), "its elaboration was looked at: {:?}", found.screened);
}

#[test]
fn a_term_that_nobody_listed_is_proposed_by_its_form() {
    let found = found_in(SWING, DEFLECTION, ("deflection", 0.2), &SWINGS);
    let said = &found.headline;
    assert!(matches!(found.verdict, Verdict::Named | Verdict::Tie), "{said}");
    assert_eq!(found.effects[0].name, "square-times:v:x:v", "{said}");
    assert_eq!(found.effects[0].kind, Kind::Proposal);
    let amplitude = &found.effects[0].parameters[0];
    assert!((amplitude.estimate + 0.2).abs() < 4.0 * amplitude.sd, "{amplitude:?}");
    assert!(found.explained_study.is_some() && said.contains("not its cause"), "{said}");
}

/// A drop that loses diameter at a steady rate.
const DROP: &str = r#"
[study]
name = "drop"
seed = 1
time_unit = "s"

[model]
kind = "equations"
outputs = [ { name = "diameter", unit = "mm", value = "d" } ]

[[model.states]]
name = "d"
unit = "mm"
initial = 1.2
rate = "-k"

[[parameters]]
name = "k"
unit = "mm/s"
prior = { transform = "linear", median = 0.01, sd = 0.01 }

[[records]]
name = "drop"
file = "drop.csv"
time = "time"
channels = [ { column = "diameter", output = "diameter", noise = 0.004 } ]
train = [0.0, 40.0]
"#;

/// Evaporation in still air, by which the square of the diameter falls steadily (Spalding 1953).
const EVAPORATION: &str = r#"
[[effects]]
name = "evaporation"
says = "Evaporation in still air."
adds = [ { to = "d", term = "-b/d" } ]
parameters = [ { name = "b", unit = "mm^2/s", range = [0, 1] } ]
"#;

#[test]
fn a_rate_that_goes_with_one_over_a_state_is_proposed_by_its_form() {
    let times = grid(100, 0.5);
    let blank = csv("time,diameter", &[&times, &vec![1.0; times.len()]]);
    let truth = Case::new(&format!("{DROP}{EVAPORATION}"), &[("drop.csv", blank)]);
    let noisy = noisy(&truth, &[("k", 0.003)], ("evaporation", 0.01), "diameter", 0.004);
    let study = Case::new(DROP, &[("drop.csv", csv("time,diameter", &[&times, &noisy]))]);
    let found = explained(&study).unwrap();
    let said = &found.headline;
    assert!(matches!(found.verdict, Verdict::Named | Verdict::Tie), "{said}");
    assert_eq!(found.effects[0].name, "inverse:d:d", "{said}");
    let amplitude = &found.effects[0].parameters[0];
    assert!((amplitude.estimate + 0.01).abs() < 4.0 * amplitude.sd, "{amplitude:?}");
    assert_eq!(amplitude.unit, "mm^2/s");
}

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
