//! Studies whose model runs in a program of its own: the same posterior as in this process, with and without restart; what
//! a study may ask of a solver; and what is missing from one.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "solver_study/explained.rs"]
mod explained;
#[path = "solver_study/inside.rs"]
mod inside;
#[path = "solver_study/messages.rs"]
mod messages;
#[path = "solver_study/rounded.rs"]
mod rounded;
mod study_kit;
#[path = "solver_study/swing.rs"]
mod swing;

use inside::{Inside, Place, no_host, threads};
use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::identify::{At, identify};
use starlings_coordinator::study::trial::trial;
use starlings_coordinator::study::twin::{Twin, simulate};
use starlings_coordinator::study::{Study, Summary};
use starlings_estimators::{Kind, ROUKF};
use study_kit::off;
use swing::{native, recording, solver};

const BATCH: &str = "[estimator]\nkind = \"batch\"\n";
const NUDGED: &str = "[observer]\nkind = \"nudging\"\ngain = 0.8\n";

/// The study as it is and as a solver, each in a folder of its own with the same recording.
fn both(more: &str, change: fn(&mut starlings_models::Description)) -> (Place, Study, Place, Study, Inside) {
    let data = recording(&[], &[], 7);
    let here = Place::new(&[("study.toml", &native(more)), ("swing.csv", &data)]);
    let there = Place::new(&[("study.toml", &solver(more)), ("swing.csv", &data)]);
    let study = here.load(&no_host()).unwrap_or_else(|error| panic!("{error}"));
    let inside = Inside::of(&study, &["v"]).described(change);
    let outside = there.load(&inside.solver_host()).unwrap_or_else(|error| panic!("{error}"));
    (here, study, there, outside, inside)
}

/// Largest difference of two posteriors: estimates in sd, sd relative, log-likelihood relative.
fn apart(a: &Summary, b: &Summary) -> f64 {
    assert_eq!(a.parameters.len(), b.parameters.len());
    let pairs = a.parameters.iter().zip(&b.parameters);
    let parameters = pairs.map(|(p, q)| ((p.estimate - q.estimate) / q.sd).abs().max(off(p.sd, q.sd, 0.0)));
    parameters.fold(off(a.fit.log_likelihood, b.fit.log_likelihood, 1.0), f64::max)
}

/// Runs both and compares. The solver computes with the arithmetic of this process: only the order in which names are resolved
/// could differ, and a posterior that it moved would not be the same study's.
fn assert_the_same(more: &str, change: fn(&mut starlings_models::Description), kind: &Kind) {
    let (here, study, there, outside, inside) = both(more, change);
    assert_eq!(outside.estimator.kind, kind);
    let want = here.run(&study, &mut InProcess::new(2), "run").unwrap();
    let got = there.run(&outside, &mut threads(&inside), "run").unwrap_or_else(|error| panic!("{error}"));
    let difference = apart(&got, &want);
    assert!(difference < 1e-10, "{more}: {difference:e}");
}

#[test]
fn a_solver_that_restarts_gives_the_posterior_of_the_same_model_in_this_process() {
    assert_the_same("", |_| {}, &ROUKF);
    assert_the_same(NUDGED, |_| {}, &ROUKF);
    assert_the_same(BATCH, |_| {}, &starlings_estimators::BATCH);
}

#[test]
fn a_solver_that_cannot_restart_is_fitted_as_a_whole_without_being_told() {
    let once: fn(&mut starlings_models::Description) = |d| d.spec.restart = false;
    let (_, _, there, outside, inside) = both("", once);
    assert_eq!(outside.estimator.kind, &starlings_estimators::BATCH);
    assert!(
        outside.warnings.iter().any(|w| w.contains("cannot restart from a state")),
        "{:?}",
        outside.warnings
    );
    let got = there.run(&outside, &mut threads(&inside), "run").unwrap();
    let (here, study, ..) = both(BATCH, |_| {});
    let want = here.run(&study, &mut InProcess::new(2), "run").unwrap();
    // As above.
    assert!(apart(&got, &want) < 1e-10);
    // Stated in the study, it gives no warning.
    let (.., said, _) = both(BATCH, once);
    assert!(!said.warnings.iter().any(|w| w.contains("restart")), "{:?}", said.warnings);
}

#[test]
fn effects_on_inputs_outputs_and_hosted_rates_are_those_of_the_model_in_this_process() {
    // An input with an effect reaches the solver as samples at the record's times and the window's, where the integrator then
    // ends further steps: equal to its tolerance (1e-10) over some hundred windows. The others are the same arithmetic.
    for (effect, median, tolerance) in [
        ("adds = [ { to = \"velocity\", term = \"q\" } ]", 0.3, 1e-10),
        ("adds = [ { to = \"force\", term = \"q*force\" } ]", 0.2, 1e-7),
        ("adds = [ { to = \"v\", term = \"-q*v*abs(v)\" } ]", 0.1, 1e-10),
    ] {
        let more = format!(
            "[[effects]]\nname = \"e\"\n{effect}\nparameters = [ {{ name = \"q\", range = [-5, 5] }} ]\n\
             [[parameters]]\nname = \"q\"\nprior = {{ transform = \"linear\", median = {median}, sd = 0.1 }}\n"
        );
        let (here, study, there, outside, inside) = both(&more, |_| {});
        let want = here.run(&study, &mut InProcess::new(2), "run").unwrap();
        let got = there.run(&outside, &mut threads(&inside), "run").unwrap_or_else(|error| panic!("{error}"));
        let difference = apart(&got, &want);
        assert!(difference < tolerance, "{effect}: {difference:e}");
    }
}

#[test]
fn trials_twins_and_sensitivities_run_the_solver_too() {
    let (_, study, _, outside, inside) = both("", |_| {});
    assert_eq!(trial(&outside).unwrap(), trial(&study).unwrap());
    let twin = Twin { noise: 0.1, seed: 4, ..Twin::default() };
    assert_eq!(simulate(&outside, &twin).unwrap(), simulate(&study, &twin).unwrap());
    let found = identify(&outside, &mut threads(&inside), &At::Prior, &mut |_| {}).unwrap();
    let want = identify(&study, &mut InProcess::new(1), &At::Prior, &mut |_| {}).unwrap();
    assert_eq!(found.rows.len(), want.rows.len());
    // The arithmetic is the same; 1e-9 is room for the order of sums.
    let worst = found
        .rows
        .iter()
        .zip(&want.rows)
        .map(|(a, b)| off(a.prediction, b.prediction, 1.0))
        .fold(0.0, f64::max);
    assert!(worst < 1e-9, "{worst:e}");
}

#[test]
fn a_twin_of_a_solver_without_restart_has_no_state_and_no_period() {
    let (.., outside, _) = both("", |d| d.spec.restart = false);
    assert!(simulate(&outside, &Twin::default()).unwrap().start.is_empty());
    let periodic = Twin { period: Some(2.0), ..Twin::default() };
    let refused = simulate(&outside, &periodic).unwrap_err().to_string();
    assert!(refused.contains("cannot restart"), "{refused}");
}

#[test]
fn a_solver_that_a_file_describes_is_not_started_where_the_study_is_loaded() {
    let (.., there, _, inside) = both("", |_| {});
    let text = serde_json::to_string_pretty(inside.description()).unwrap();
    there.write("swing.json", &text);
    there.write(
        "study.toml",
        &solver("").replace("command = [\"swing\"]", "command = [\"swing\"]\ndescribed = \"swing.json\""),
    );
    // No solver can be started here, and none has to be.
    let study = there.load(&no_host()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(study.setup.model.description(), Some(inside.description()));
    assert_eq!(trial(&study).unwrap(), []);
    assert!(study.warnings.iter().any(|w| w.contains("described by a file")), "{:?}", study.warnings);
    assert!(there.run(&study, &mut threads(&inside), "run").is_ok());
}

#[test]
fn a_run_is_not_continued_with_another_solver_or_other_files_of_it() {
    let (_, _, there, outside, inside) = both("", |_| {});
    there.run(&outside, &mut threads(&inside), "run").unwrap();
    there.resume(&outside, "run").unwrap();
    let other = inside.described(|d| d.spec.parameters[0].unit = "kN/m".to_owned());
    let changed = there.load(&other.solver_host()).unwrap();
    let refused = there.resume(&changed, "run").unwrap_err().to_string();
    assert!(refused.contains("the solver or one of its files changed since"), "{refused}");
}
