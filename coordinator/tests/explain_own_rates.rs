//! Terms made of the rates that a model has: one that goes with an input as well, one that is missing in another equation.
#![allow(missing_docs, clippy::unwrap_used)]

mod explained_kit;
mod study_kit;

use explained_kit::{explained, noisy};
use starlings_coordinator::explain::{Explanation, Kind, Verdict};
use study_kit::{Case, csv, grid, normals};

/// A plate in the sun that loses heat to the air.
const PLATE: &str = r#"
[study]
name = "plate"
seed = 1
time_unit = "min"

[model]
kind = "equations"
outputs = [ { name = "probe", unit = "K", value = "T" } ]
inputs = [ { name = "sun", unit = "W/m^2" }, { name = "wind", unit = "m/s" }, { name = "air", unit = "K" } ]

[[model.states]]
name = "T"
unit = "K"
initial = 290
rate = { sun = "eta*sun", loss = "-u*(T - air)" }

[[parameters]]
name = "eta"
unit = "K m^2/(W min)"
prior = { transform = "log", median = 0.004, factor = 1.5 }

[[parameters]]
name = "u"
unit = "1/min"
prior = { transform = "log", median = 0.04, factor = 1.5 }

[[records]]
name = "day"
file = "day.csv"
channels = [ { column = "probe", output = "probe", noise = 0.2 } ]
inputs = { sun = "sun", wind = "wind", air = "air" }
train = [0.0, 280.0]
"#;

/// A loss that grows with the wind.
const WINDY: &str = r#"
[[effects]]
name = "windy"
says = "A loss that grows with the wind."
adds = [ { to = "T", term = "-b*wind*(T - air)" } ]
parameters = [ { name = "b", unit = "s/(m min)", range = [0, 1] } ]
"#;

/// A first-order reaction whose rate depends on the temperature of a jacketed tank.
const TANK: &str = r#"
[study]
name = "tank"
seed = 1
time_unit = "min"

[model]
kind = "equations"
outputs = [ { name = "assay", unit = "mol/L", value = "c" }, { name = "probe", unit = "K", value = "T" } ]
inputs = [ { name = "jacket", unit = "K" }, { name = "feed", unit = "mol/L" } ]

[[model.states]]
name = "c"
unit = "mol/L"
initial = 0.5
rate = { flow = "q*(feed - c)", reaction = "-k*exp(-6000*(1/T - 1/330))*c" }

[[model.states]]
name = "T"
unit = "K"
initial = 320
rate = { flow = "q*(310 - T)", jacket = "-ua*(T - jacket)" }

[[parameters]]
name = "q"
unit = "1/min"
prior = { transform = "log", median = 0.1, factor = 1.2 }

[[parameters]]
name = "k"
unit = "1/min"
prior = { transform = "log", median = 0.2, factor = 1.5 }

[[parameters]]
name = "ua"
unit = "1/min"
prior = { transform = "log", median = 0.3, factor = 1.3 }

[[records]]
name = "run"
file = "run.csv"
channels = [ { column = "assay", output = "assay", noise = 0.01 }, { column = "probe", output = "probe", noise = 0.3 } ]
inputs = { jacket = "jacket", feed = "feed" }
train = [0.0, 90.0]
"#;

/// The heat of the reaction.
const HEAT: &str = r#"
[[effects]]
name = "heat"
says = "The reaction heats the tank."
adds = [ { to = "T", term = "b*k*exp(-6000*(1/T - 1/330))*c" } ]
parameters = [ { name = "b", unit = "K L/mol", range = [0, 100] } ]
"#;

/// Steps between two levels at irregular times, by a short sum of sines.
fn steps(times: &[f64], [low, high]: [f64; 2], period: f64) -> Vec<f64> {
    let turn = |t: f64| (t / period).sin() + 0.7 * (2.3 * t / period + 1.0).sin();
    times.iter().map(|t| if turn(*t) > 0.0 { high } else { low }).collect()
}

/// Checks that a proposal is named alone, with this coefficient.
fn proposes(found: &Explanation, name: &str, truth: f64, unit: &str) {
    let said = &found.headline;
    assert_eq!(found.verdict, Verdict::Named, "{said}");
    let effect = &found.effects[0];
    assert_eq!((effect.name.as_str(), effect.kind), (name, Kind::Proposal), "{said}");
    let amplitude = &effect.parameters[0];
    assert!((amplitude.estimate - truth).abs() < 4.0 * amplitude.sd, "{amplitude:?}");
    assert!(amplitude.sd < 0.1 * truth.abs(), "{amplitude:?}");
    assert_eq!(amplitude.unit, unit, "{said}");
}

#[test]
fn a_loss_that_an_input_changes_as_well_is_proposed_with_its_own_driving_difference() {
    let times = grid(400, 1.0);
    let sun = times.iter().map(|t| 500.0 + 400.0 * (t / 60.0).sin()).collect::<Vec<f64>>();
    let wind = steps(&times, [0.5, 4.0], 9.0);
    let air = times.iter().map(|t| 290.0 + 6.0 * (t / 90.0).cos()).collect::<Vec<f64>>();
    let recording = |probe: &[f64]| csv("time,probe,sun,wind,air", &[&times, probe, &sun, &wind, &air]);
    let truth = Case::new(&format!("{PLATE}{WINDY}"), &[("day.csv", recording(&vec![290.0; times.len()]))]);
    let noisy = noisy(&truth, &[("eta", 0.0042), ("u", 0.03)], ("windy", 0.012), "probe", 0.2);
    let found = explained(&Case::new(PLATE, &[("day.csv", recording(&noisy))])).unwrap();
    // In proportion to the loss, u of which is 0.03.
    proposes(&found, "rate-times:T:loss:wind", 0.4, "s/m");
}

#[test]
fn a_rate_that_acts_in_another_equation_too_is_proposed_there() {
    let times = grid(240, 0.5);
    let (jacket, feed) = (steps(&times, [305.0, 318.0], 7.0), steps(&times, [0.6, 1.4], 5.0));
    let recording = |assay: &[f64], probe: &[f64]| {
        csv("time,assay,probe,jacket,feed", &[&times, assay, probe, &jacket, &feed])
    };
    let blank = vec![1.0; times.len()];
    let truth = Case::new(&format!("{TANK}{HEAT}"), &[("run.csv", recording(&blank, &blank))]);
    let values = [("q", 0.105), ("k", 0.18), ("ua", 0.32)];
    let of = |column, sd| noisy(&truth, &values, ("heat", 60.0), column, sd);
    // Each channel has a noise of its own.
    let probe: Vec<f64> =
        of("probe", 0.0).iter().zip(normals(times.len(), 6)).map(|(v, e)| v + 0.3 * e).collect();
    let recorded = recording(&of("assay", 0.01), &probe);
    let found = explained(&Case::new(TANK, &[("run.csv", recorded)])).unwrap();
    // What it uses up of c it gives to T.
    proposes(&found, "rate-of:T:c:reaction", -60.0, "K L/mol");
}
