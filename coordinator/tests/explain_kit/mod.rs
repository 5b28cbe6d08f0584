//! A swing whose recording has an effect in it that the study lacks, and its explanation in this process.

use std::path::Path;

use starlings_coordinator::explain::{Context, ExplainError, Explanation, Findings, Options, explain};
use starlings_coordinator::fleet::{Fleet, InProcess};
use starlings_coordinator::study::store::Store;
use starlings_coordinator::study::twin::{Twin, simulate};
use starlings_coordinator::study::{Stage, Study};

use crate::study_kit::{Case, csv, grid};

/// A decaying swing of a mass on a spring; a test adds what else acts on it.
pub(crate) fn study(more: &str, explain: &str) -> String {
    format!(
        r#"
[study]
name = "swing"
seed = 3

[model]
kind = "equations"
outputs = [ {{ name = "position", unit = "m", role = "displacement", value = "x" }} ]
{more}

[[model.states]]
name = "x"
unit = "m"
role = "displacement"
initial = 0.0
rate = "v"

[[model.states]]
name = "v"
unit = "m/s"
role = "velocity"
initial = 0.0
rate = {{ spring = "-k*x", viscous = "-c*v" }}

[[parameters]]
name = "k"
unit = "1/s^2"
prior = {{ transform = "log", median = 9.0, factor = 1.5 }}

[[parameters]]
name = "c"
unit = "1/s"
prior = {{ transform = "log", median = 0.2, factor = 2.0 }}

[[parameters]]
name = "initial:x"
unit = "m"
prior = {{ transform = "linear", median = 1.0, sd = 0.2 }}

[[records]]
name = "free"
file = "free.csv"
time = "time"
channels = [ {{ column = "position", output = "position", noise = 0.01 }} ]
train = [0.0, 9.0]

[explain]
{explain}

[[effects]]
name = "wind"
says = "A wind pushes with the square of the speed against it."
adds = [ {{ to = "v", term = "-w*(v + 0.5)*abs(v + 0.5)" }} ]
parameters = [ {{ name = "w", unit = "1/m", range = [0, 10] }} ]
"#
    )
}

/// A recording of that swing with an effect of this amplitude in it and noise of 0.01 m.
pub(crate) fn recording(study: &str, effects: &[(&str, f64)], values: &[(&str, f64)], seed: u64) -> String {
    let times = grid(300, 0.05);
    let blank = csv("time,position", &[&times, &vec![0.0; times.len()]]);
    let case = Case::new(study, &[("free.csv", blank)]);
    let named =
        |list: &[(&str, f64)]| list.iter().map(|(name, v)| ((*name).to_owned(), *v)).collect::<Vec<_>>();
    let twin = Twin {
        values: [
            &[("k".to_owned(), 10.0), ("c".to_owned(), 0.15), ("initial:x".to_owned(), 1.1)],
            &named(values)[..],
        ]
        .concat(),
        effects: named(effects),
        noise: 0.01,
        seed,
        ..Twin::default()
    };
    let made = simulate(&case.study(), &twin).unwrap();
    csv("time,position", &[&made.times, &made.values[0]])
}

pub(crate) fn go(
    case: &Case,
    path: &Path,
    fleet: &mut dyn Fleet,
    options: &Options,
) -> Result<Findings, ExplainError> {
    watched(case, path, fleet, options, &mut |_| {})
}

/// The same, and every stage is told.
pub(crate) fn watched(
    case: &Case,
    path: &Path,
    fleet: &mut dyn Fleet,
    options: &Options,
    watch: &mut dyn FnMut(&Stage),
) -> Result<Findings, ExplainError> {
    let study: Study = case.study();
    std::fs::create_dir_all(path).unwrap();
    let database = path.join("run.db");
    let store =
        if database.exists() { Store::open(&database) } else { Store::create(&database, &[]) }.unwrap();
    let mut context = Context { clock: &|| 0.0, watch, events: None, earlier_s: 0.0 };
    explain(&study, fleet, &store, &mut context, options)
}

pub(crate) fn explained(study: &str, data: String) -> Findings {
    let case = Case::new(study, &[("free.csv", data)]);
    go(&case, &case.fresh(), &mut InProcess::new(2), &Options::default())
        .unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn sets(found: &Explanation) -> Vec<Vec<String>> {
    let best = found.effects.iter().map(|e| e.name.clone()).collect();
    std::iter::once(best).chain(found.tied_with.clone()).collect()
}

/// A recording with a cubic spring in it.
pub(crate) fn cubic() -> (String, String) {
    let study = study("", "");
    let data = recording(&study, &[("cubic-stiffness", 2.0)], &[], 5);
    (study, data)
}
