//! A budget is kept at every stage of the search, and a run that was lost with its workers is an error and not a failure of the
//! model.
#![allow(clippy::unwrap_used)]

mod study_kit;

use std::path::Path;

use starlings_coordinator::explain::locate::MOST_RUNS;
use starlings_coordinator::explain::{Context, ExplainError, Explanation, Options, Verdict, explain};
use starlings_coordinator::fleet::{Fleet, FleetError, InProcess, Outcome, SetupId};
use starlings_coordinator::study::RunError;
use starlings_coordinator::study::store::Store;
use starlings_coordinator::study::twin::{Twin, simulate};
use starlings_models::{Job, Setup};
use study_kit::{Case, csv, grid};

/// A built-in model with a step of its own: effects in its rates are compared with a run of their own.
const VESSEL: &str = r#"
[study]
name = "vessel"
seed = 1
time_unit = "s"

[model]
kind = "windkessel-2"

[[parameters]]
name = "R"
unit = "mmHg s/mL"
prior = { transform = "log", median = 1.0, factor = 2.0 }

[[parameters]]
name = "C"
unit = "mL/mmHg"
prior = { transform = "log", median = 1.5, factor = 2.0 }

[[records]]
name = "beats"
file = "beats.csv"
time = "time"
inputs = { flow = "flow" }
channels = [ { column = "pressure", output = "pressure", noise = 1.0 } ]
train = [0.0, 3.0]

[explain]
only = ["series-resistance", "nonlinear-compliance", "inertance"]
"#;

/// A relaxation whose rate is no number beyond the prior median of its first parameter, two terms that look alike, and one
/// that has no influence at any amplitude and is measured again and again.
const BRINK: &str = r#"
[study]
name = "brink"
seed = 2

[model]
kind = "equations"
outputs = [ { name = "level", unit = "V", value = "h" } ]

[[model.states]]
name = "h"
unit = "V"
initial = 2.0
rate = "-k*h + 0*sqrt(0.5 - k)"

[[model.states]]
name = "idle"
initial = 1.0
rate = "-idle"

[[parameters]]
name = "k"
unit = "1/s"
prior = { transform = "linear", median = 0.5, sd = 0.2 }

[[records]]
name = "emptying"
file = "emptying.csv"
time = "time"
channels = [ { column = "level", output = "level", noise = 0.01 } ]
train = [0.0, 6.0]

[explain]
only = ["leak", "seep", "unseen"]

[[effects]]
name = "leak"
says = "A leak grows with the square of the level."
adds = [ { to = "h", term = "-a*h*abs(h)" } ]
parameters = [ { name = "a", unit = "1/(V s)", range = [0, 10] } ]

[[effects]]
name = "seep"
says = "A leak that grows with the square of the level, nearly."
adds = [ { to = "h", term = "-b*h*abs(h + 0.001)" } ]
parameters = [ { name = "b", unit = "1/(V s)", range = [0, 10] } ]

[[effects]]
name = "unseen"
says = "Nothing that is measured knows of it."
adds = [ { to = "idle", term = "-d*idle" } ]
parameters = [ { name = "d", unit = "1/s", range = [0, 10] } ]
"#;

/// Counts the jobs that it computes and loses one of them, if any.
struct Counting {
    inner: InProcess,
    calls: usize,
    jobs: u64,
    lost: Option<usize>,
}

impl Counting {
    fn new(lost: Option<usize>) -> Self {
        Self { inner: InProcess::new(1), calls: 0, jobs: 0, lost }
    }
}

impl Fleet for Counting {
    fn install(&mut self, setup: &Setup) -> Result<SetupId, FleetError> {
        self.inner.install(setup)
    }

    fn run_mixed(&mut self, jobs: Vec<(SetupId, Job)>) -> Result<Vec<Outcome>, FleetError> {
        self.jobs += jobs.len() as u64;
        if self.lost == Some(self.calls) {
            let Job { particle, record, .. } = jobs[0].1;
            let reason = "the machine went away".to_owned();
            return Err(FleetError::NoAnswer { job: 0, particle, record, reason });
        }
        self.calls += 1;
        self.inner.run_mixed(jobs)
    }

    fn n_workers(&self) -> usize {
        1
    }

    fn slots(&self) -> usize {
        1
    }
}

/// A study and what its model measures with these effects and parameters, and noise.
fn case(text: &str, file: &str, columns: &[(&str, Vec<f64>)], twin: &Twin) -> Case {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let table = |measured: &[f64]| {
        let values: Vec<&[f64]> =
            columns.iter().map(|(_, v)| if v.is_empty() { measured } else { v.as_slice() }).collect();
        csv(&names.join(","), &values)
    };
    let n = columns[0].1.len();
    let blank = Case::new(text, &[(file, table(&vec![0.0; n]))]);
    let made = simulate(&blank.study(), twin).unwrap();
    Case::new(text, &[(file, table(&made.values[0]))])
}

fn named(list: &[(&str, f64)]) -> Vec<(String, f64)> {
    list.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
}

fn vessel() -> Case {
    let times = grid(120, 0.04);
    let flow = |t: &f64| if t.fract() < 0.3 { 200.0 * (10.5 * t.fract()).sin().max(0.0) } else { 0.0 };
    let flow = times.iter().map(flow).collect();
    let twin = Twin {
        values: named(&[("R", 1.2), ("C", 1.1)]),
        effects: named(&[("series-resistance", 0.05)]),
        noise: 1.0,
        ..Twin::default()
    };
    case(VESSEL, "beats.csv", &[("time", times), ("pressure", Vec::new()), ("flow", flow)], &twin)
}

fn brink() -> Case {
    let twin = Twin {
        values: named(&[("k", 0.05)]),
        effects: named(&[("leak", 0.15)]),
        noise: 0.01,
        ..Twin::default()
    };
    case(BRINK, "emptying.csv", &[("time", grid(80, 0.1)), ("level", Vec::new())], &twin)
}

fn go(
    case: &Case,
    path: &Path,
    fleet: &mut dyn Fleet,
    budget: Option<u64>,
) -> Result<Explanation, ExplainError> {
    std::fs::create_dir_all(path).unwrap();
    let database = path.join("run.db");
    let store =
        if database.exists() { Store::open(&database) } else { Store::create(&database, &[]) }.unwrap();
    let mut context = Context { clock: &|| 0.0, watch: &mut |_| {}, events: None, earlier_s: 0.0 };
    let options = Options { budget, ..Options::default() };
    Ok(explain(&case.study(), fleet, &store, &mut context, &options)?.explanation)
}

fn stage(found: &Explanation, name: &str) -> u64 {
    found.runs_by_stage.iter().find(|(stage, _)| stage == name).map_or(0, |(_, runs)| *runs)
}

/// Every budget from one run to more than the full search needs. From that of the fit on they share a folder: remembered runs are
/// not computed again, and still count against the budget.
fn kept(case: &Case) -> Vec<Explanation> {
    let full = go(case, &case.fresh(), &mut InProcess::new(2), None).unwrap();
    let folder = case.fresh();
    let mut found = Vec::new();
    // The search for unknown inputs starts only if the budget suffices for the most runs that it may need.
    for budget in 1..=full.runs + (MOST_RUNS + 2 * 2) as u64 {
        let mut fleet = Counting::new(None);
        let path = if budget <= stage(&full, "fit") { case.fresh() } else { folder.clone() };
        match go(case, &path, &mut fleet, Some(budget)) {
            Ok(cut) => {
                assert!(cut.runs <= budget, "{} of {budget}: {:?}", cut.runs, cut.runs_by_stage);
                // An unknown input is followed window by window: many jobs for one run of a record.
                assert!(
                    fleet.jobs <= budget || stage(&cut, "locate") > 1,
                    "{} computed of {budget}",
                    fleet.jobs
                );
                found.push(cut);
            }
            // The fit, and one run for the courses of the fitted model.
            Err(ExplainError::Budget { .. }) => {
                assert!(fleet.jobs <= budget && budget <= stage(&full, "fit"), "{} of {budget}", fleet.jobs);
            }
            Err(error) => panic!("{error}"),
        }
    }
    assert_eq!(found.last().unwrap().runs_by_stage, full.runs_by_stage);
    found
}

#[test]
fn no_budget_is_exceeded_with_a_model_that_has_a_step_of_its_own() {
    let found = kept(&vessel());
    let full = found.last().unwrap();
    assert_ne!(full.verdict, Verdict::NoGap, "{}", full.headline);
    assert!(stage(full, "refit") > 0 && stage(full, "locate") > 1, "{:?}", full.runs_by_stage);
}

#[test]
fn no_budget_is_exceeded_where_the_model_fails_on_one_side_and_a_candidate_is_measured_again() {
    let found = kept(&brink());
    let full = found.last().unwrap();
    assert!(matches!(full.verdict, Verdict::Named | Verdict::Tie), "{}", full.headline);
    // A refit that the budget cut off may still be the best; then a warning says that it has not converged.
    let told =
        |e: &Explanation| e.warnings.iter().any(|w| w.contains("has not converged") || w.contains("secant"));
    assert!(found.iter().any(|e| !e.effects.is_empty() && told(e)));
    assert!(!told(full), "{:?}", full.warnings);
}

#[test]
fn a_run_that_was_lost_ends_the_explanation_whatever_it_was_for() {
    let case = brink();
    let mut fleet = Counting::new(None);
    let folder = case.fresh();
    let full = go(&case, &folder, &mut fleet, None).unwrap();
    assert!(full.experiment.is_some() && stage(&full, "add") > 0, "{:?}", full.runs_by_stage);
    for lost in 0..fleet.calls {
        let found = go(&case, &case.fresh(), &mut Counting::new(Some(lost)), None);
        let Err(ExplainError::Run(RunError::NoAnswer { record, reason, .. })) = found else {
            panic!("call {lost} of {}: {found:?}", fleet.calls)
        };
        assert!(record == "emptying" && reason.contains("the machine went away"), "{record}: {reason}");
    }
}

#[test]
fn the_runs_of_an_experiment_are_remembered_too() {
    let case = brink();
    let folder = case.fresh();
    let full = go(&case, &folder, &mut InProcess::new(1), None).unwrap();
    let mut again = Counting::new(None);
    let mut found = go(&case, &folder, &mut again, None).unwrap();
    found.workers = full.workers;
    assert_eq!(found, full);
    // Unknown inputs are followed window by window, and these runs are not remembered; all others are.
    let followed = again.jobs;
    assert!(followed > 0, "one state's input is felt");
    let windows = 61;
    assert_eq!(
        again.calls,
        2 + 1 + windows,
        "two batches for all equations, then the start and every window of one"
    );
}
