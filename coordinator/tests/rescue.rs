//! Sigma points that cannot be run: pulled towards the mean, dropped, or the end of the run with advice.
#![allow(clippy::unwrap_used)]
mod study_kit;

use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::RunError;
use study_kit::fleets::{At, Failing, Mortal};
use study_kit::{Case, Done, csv, grid, linear, normals};

/// A decay whose rate k has an upper limit in the model, the wall: beyond it the logarithm is no number.
fn walled(estimator: &str, wall: f64) -> Case {
    let times = grid(30, 0.1);
    let noise = normals(30, 9);
    let z: Vec<f64> = times.iter().zip(noise).map(|(t, e)| 2.0 * (-1.2 * t).exp() + 0.02 * e).collect();
    let study = format!(
        r#"
[study]
name = "walled"
[model]
kind = "equations"
constants = {{ wall = {wall} }}
outputs = [ {{ name = "y", value = "x" }} ]
[[model.states]]
name = "x"
initial = 2.0
rate = "-k*x + 1e-12*log(wall - k)"
[[parameters]]
name = "k"
prior = {{ transform = "linear", median = 1.0, sd = 0.8 }}
[[parameters]]
name = "initial:x"
prior = {{ transform = "linear", median = 1.5, sd = 0.5 }}
[[records]]
name = "one"
file = "decay.csv"
channels = [ {{ column = "y", output = "y", noise = 0.02 }} ]
[estimator]
{estimator}
"#
    );
    Case::new(&study, &[("decay.csv", csv("time,y", &[&times, &z]))])
}

fn assert_rescued(done: &Done, what: &str) {
    let s = &done.summary;
    assert!(s.runs.rescued > 0 && s.runs.failed >= s.runs.rescued, "{what}: {:?}", s.runs);
    assert!(done.warns("pulled towards the mean"), "{what}: {:?}", s.warnings);
    for (name, truth) in [("k", 1.2), ("initial:x", 2.0)] {
        let p = done.estimate(name);
        // Three and a half sd: one estimate in two thousand lies further off.
        assert!((p.estimate - truth).abs() < 3.5 * p.sd, "{what}: {name} {} ± {}", p.estimate, p.sd);
        assert!(p.sd < 0.1, "{what}: {name} is known to {}", p.sd);
    }
}

#[test]
fn a_model_that_fails_beyond_a_wall_is_estimated_with_pulled_points() {
    for (estimator, wall) in [
        ("passes = 1", 1.5),
        ("passes = 2", 1.3),
        ("passes = 2\npoints = \"canonical\"", 1.5),
        ("passes = 2\npoints = \"star\"", 1.3),
    ] {
        let done = walled(estimator, wall).run();
        assert_rescued(&done, estimator);
        let lost = done.table("analyses", "information_lost");
        let lost: Vec<f64> = lost.iter().map(|row| row[0].parse().unwrap()).collect();
        assert!(lost.iter().any(|l| *l > 0.01) && lost.iter().all(|l| *l < 1.0), "{estimator}: {lost:?}");
        assert!(!done.warns(" 0 % of the ensemble"), "{:?}", done.summary.warnings);
    }
}

#[test]
fn the_batch_fit_goes_round_a_wall() {
    // Points of the default width stay in front of it; wide ones and steps beyond it fail.
    let done = walled("kind = \"batch\"\nspread = 0.8", 1.3).run();
    assert!(done.summary.runs.failed > 0, "{:?}", done.summary.runs);
    let k = done.estimate("k");
    assert!((k.estimate - 1.2).abs() < 3.5 * k.sd && k.sd < 0.1, "{} ± {}", k.estimate, k.sd);
}

fn line(estimator: &str) -> Case {
    let (times, z) = linear::data(20, 6);
    Case::new(&linear::study(estimator), &[("line.csv", linear::file(&times, &z))])
}

fn assert_same(a: &Done, b: &Done, passes: usize, what: &str) {
    let worst = a.summary.parameters.iter().zip(&b.summary.parameters).fold(0.0_f64, |worst, (a, b)| {
        worst.max((a.estimate - b.estimate).abs() / b.sd).max((a.sd / b.sd - 1.0).abs())
    });
    // The regression is exact for a linear model at any distance: roundings remain. A second pass takes its tight prior
    // out again, which costs the digits by which that prior outweighs the data.
    assert!(worst < if passes == 1 { 1e-8 } else { 1e-6 }, "{what}: {worst:e}");
    let (a, b) = (a.summary.fit.log_likelihood, b.summary.fit.log_likelihood);
    assert!((a - b).abs() < 1e-7 * b.abs(), "{what}: {a} {b}");
}

#[test]
fn a_linear_model_gives_the_same_posterior_with_and_without_a_pulled_point() {
    for (passes, points) in [(1, "simplex"), (2, "simplex"), (1, "star"), (2, "canonical")] {
        let estimator = &format!("passes = {passes}\npoints = \"{points}\"");
        let case = line(estimator);
        let whole = case.run_on(&mut InProcess::new(1)).unwrap();
        for (particle, step) in [(0, 0), (1, 4), (3, 12)] {
            // Fails at its full distance and at half of it.
            let mut tries = 0;
            let mut fleet = Failing::new(|at: &At<'_>| {
                let here = at.job.particle == particle && at.ensemble >= step && tries < 2;
                tries += usize::from(here);
                here
            });
            let pulled = case.run_on(&mut fleet).unwrap();
            assert_same(&pulled, &whole, passes, &format!("{estimator}, particle {particle} at {step}"));
            assert_eq!((pulled.summary.runs.rescued, pulled.summary.runs.failed), (1, 2));
            assert!(pulled.warns("1 sigma point"), "{:?}", pulled.summary.warnings);
            let lost: f64 = pulled
                .table("analyses", "information_lost")
                .iter()
                .fold(0.0, |most, row| f64::max(most, row[0].parse().unwrap()));
            assert!(lost > 0.05, "a quarter of the distance costs spread: {lost}");
        }
    }
}

#[test]
fn several_failing_points_of_one_ensemble_are_pulled_one_by_one() {
    let case = line("passes = 1");
    let whole = case.run_on(&mut InProcess::new(1)).unwrap();
    let mut fleet = Failing::new(|at: &At<'_>| at.ensemble == 3 && at.job.particle != 2 && !at.retried);
    let pulled = case.run_on(&mut fleet).unwrap();
    assert_same(&pulled, &whole, 1, "three of four points");
    assert_eq!(pulled.summary.runs.rescued, 3);
}

#[test]
fn a_star_drops_a_centre_that_never_runs_and_goes_on() {
    let case = line("passes = 2\npoints = \"star\"");
    let whole = case.run_on(&mut InProcess::new(1)).unwrap();
    let mut fleet = Failing::new(|at: &At<'_>| at.job.particle == 6);
    let dropped = case.run_on(&mut fleet).unwrap();
    assert_same(&dropped, &whole, 2, "no centre");
    assert_eq!(dropped.summary.runs.rescued, 40, "twenty analyses in two passes");
    assert!(dropped.warns("pulled towards the mean or dropped"));
}

#[test]
fn a_star_goes_on_without_one_arm() {
    let case = line("passes = 1\npoints = \"star\"");
    let whole = case.run_on(&mut InProcess::new(1)).unwrap();
    let mut fleet = Failing::new(|at: &At<'_>| at.job.particle == 1 && at.ensemble % 3 == 1);
    let dropped = case.run_on(&mut fleet).unwrap();
    assert_same(&dropped, &whole, 1, "one arm less");
    assert!(dropped.summary.runs.rescued > 3);
}

#[test]
fn a_simplex_that_fails_next_to_the_mean_ends_the_run_with_advice() {
    let case = line("passes = 2");
    let path = case.fresh();
    let mut fleet = Failing::new(|at: &At<'_>| at.job.particle == 2 && at.ensemble >= 25);
    let error = case.go(&path, &mut fleet).err().unwrap();
    assert!(matches!(error, RunError::SigmaPointLost { particle: 2, pass: 2, step: 5, .. }), "{error:?}");
    let text = error.to_string();
    for part in ["even next to the mean", "a = ", "initial:x = ", "made to fail", "logit", "star points"] {
        assert!(text.contains(part), "`{part}` is missing: {text}");
    }
    // What was stored is kept: the same run goes on once the model runs again.
    let done = case.go(&path, &mut InProcess::new(1)).unwrap();
    assert_eq!(done.csv, case.run().csv);
}

#[test]
fn a_model_that_always_fails_ends_the_run_and_says_why() {
    for estimator in ["passes = 1", "points = \"star\"", "kind = \"batch\""] {
        let error = line(estimator).run_on(&mut Failing::new(|_: &At<'_>| true)).err().unwrap();
        let text = error.to_string();
        let words =
            if estimator.contains("batch") { "cannot be run at the prior mean" } else { "made to fail" };
        assert!(text.contains(words), "{estimator}: {text}");
    }
}

#[test]
fn failures_stand_in_the_result_of_a_resumed_run_as_if_it_had_never_been_broken() {
    for estimator in ["passes = 2", "kind = \"batch\"\nspread = 0.8"] {
        let case = walled(estimator, 1.3);
        let whole = case.run_on(&mut InProcess::new(1)).unwrap();
        let failures = &whole.summary.failures;
        assert!(!failures.is_empty(), "{estimator}");
        let path = case.fresh();
        let mut starts = 0;
        // Every start makes a few batches more.
        let resumed = loop {
            starts += 1;
            if let Ok(done) = case.go(&path, &mut Mortal::new(starts)) {
                break done;
            }
        };
        assert!(starts > 2, "{estimator}");
        assert_eq!(&resumed.summary.failures, failures, "{estimator}");
        assert_eq!(resumed.summary.warnings, whole.summary.warnings, "{estimator}");
        assert_eq!(resumed.csv, whole.csv, "{estimator}");
    }
}
