//! The same study gives the same bytes, whatever computes it, in whatever order, and however often it is interrupted.
#![allow(clippy::unwrap_used)]
mod study_kit;

use std::fmt::Write as _;

use starlings_coordinator::fleet::InProcess;
use study_kit::fleets::{Mortal, Shuffled};
use study_kit::{Case, Done, csv, grid, linear, normals};

/// An arterial pressure over 11 samples, from a two-parameter Windkessel whose start is not known.
fn aorta(seed: u64, offset: f64) -> String {
    let times = grid(11, 0.08);
    let flow: Vec<f64> = times.iter().map(|t| 60.0 * (8.0 * t).sin().max(0.0)).collect();
    let noise = normals(11, seed);
    let pressure: Vec<f64> =
        (0..11).map(|i| 80.0 + offset + 0.3 * flow[i] - 10.0 * times[i] + noise[i]).collect();
    csv("time,pressure,flow", &[&times, &pressure, &flow])
}

fn windkessel(estimator: &str, records: usize, more: &str) -> Case {
    let mut text = r#"
[study]
name = "aorta"
[model]
kind = "windkessel-3"
[[parameters]]
name = "R"
per_record = true
prior = { transform = "log", median = 1.5, factor = 1.5 }
PROCESS
[[parameters]]
name = "C"
prior = { transform = "log", median = 1.0, factor = 2.0 }
[[parameters]]
name = "Zc"
prior = { transform = "logit(0, 1)", median = 0.2, sd = 0.7 }
[[parameters]]
name = "initial:p"
prior = { transform = "linear", median_from = "pressure", sd = 10.0 }
"#
    .replace("PROCESS", more);
    let names = ["one", "two", "three"];
    let mut files = Vec::new();
    let file_names = ["one.csv", "two.csv", "three.csv"];
    for i in 0..records {
        let train = [0.8, 0.6, 0.4][i];
        write!(
            text,
            "[[records]]\nname = \"{}\"\nfile = \"{}\"\ninputs = {{ flow = \"flow\" }}\nevery = {}\n\
             channels = [ {{ column = \"pressure\", output = \"pressure\", noise = 2.0 }} ]\ntrain = [0.0, {train}]\n",
            names[i],
            file_names[i],
            1 + i
        )
        .unwrap();
        files.push((file_names[i], aorta(i as u64, 5.0 * i as f64)));
    }
    text.push_str("[estimator]\n");
    text.push_str(estimator);
    Case::new(&text, &files)
}

/// Every way to fit, with its name.
fn cases() -> Vec<(&'static str, Case)> {
    vec![
        ("one pass", windkessel("passes = 1", 1, "")),
        ("two passes", windkessel("passes = 2", 1, "")),
        ("three passes, Cholesky root", windkessel("passes = 3\nroot = \"cholesky\"", 1, "")),
        ("as many passes as it takes", windkessel("", 1, "")),
        ("as many as it takes, several records, star points", windkessel("points = \"star\"", 2, "")),
        ("star points, resampled", windkessel("points = \"star\"\npasses = 2", 1, "")),
        ("several records", windkessel("passes = 2", 3, "")),
        ("several records, star points", windkessel("points = \"star\"\npasses = 2", 3, "")),
        ("forgetting", windkessel("passes = 1", 1, "process = { forgetting = 0.9 }")),
        ("a random walk", windkessel("points = \"canonical\"", 2, "process = { walk = 0.05 }")),
        ("batch", windkessel("kind = \"batch\"", 2, "")),
        ("batch, stopped early", windkessel("kind = \"batch\"\nmax_iterations = 3", 1, "")),
    ]
}

/// Everything that must not depend on what computed it and when.
fn essence(done: &Done) -> String {
    let s = &done.summary;
    let table = |name, columns| format!("{:?}", done.table(name, columns));
    [
        done.csv.clone(),
        format!("{:?} {:?} {:?} {:?}", s.parameters, s.correlation, s.fit, s.warnings),
        table("estimates", "pass, step, parameter, estimate, lo, hi, mean, sd"),
        table("analyses", "pass, step, time, n_used, nis, log_likelihood, information_lost"),
        table("innovations", "pass, step, record, output, time, innovation, sd"),
        table("predictions", "record, output, time, observed, predicted, use, noise"),
        table("jobs", "pass, step, record, particle, status, error"),
    ]
    .join("\n")
}

#[test]
fn the_number_of_threads_and_the_order_of_computing_do_not_change_a_byte() {
    for (name, case) in cases() {
        let reference = case.run_on(&mut InProcess::new(1)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let runs = &reference.summary.runs;
        for threads in [2, 5] {
            let repeated = case.run_on(&mut InProcess::new(threads)).unwrap();
            assert!(essence(&repeated) == essence(&reference), "{name} on {threads} threads");
            assert_eq!(&repeated.summary.runs, runs, "{name}");
        }
        let shuffled = case.run_on(&mut Shuffled::new(3)).unwrap();
        assert!(essence(&shuffled) == essence(&reference), "{name}, shuffled");
        assert_eq!(shuffled.summary.runs.total, runs.total, "{name}");
        assert!(shuffled.summary.runs.retried > 0, "the shuffled fleet says that it tried some jobs again");
    }
}

/// Runs until the fleet stops after so many calls, then to the end on another fleet.
fn interrupted(case: &Case, calls: usize) -> Done {
    let path = case.fresh();
    let error = case.go(&path, &mut Mortal::new(calls)).err().unwrap();
    assert!(error.to_string().contains("cancelled"), "{error}");
    case.go(&path, &mut InProcess::new(2)).unwrap_or_else(|e| panic!("{calls} calls: {e}"))
}

#[test]
fn a_run_interrupted_at_any_call_and_continued_ends_with_the_same_bytes() {
    // Hundreds of databases are made and closed, which is waiting for the disk: the cases wait together.
    std::thread::scope(|scope| {
        for (name, case) in cases() {
            scope.spawn(move || interrupt_everywhere(name, &case));
        }
    });
}

fn interrupt_everywhere(name: &str, case: &Case) {
    let mut whole = Mortal::new(usize::MAX);
    let reference = case.run_on(&mut whole).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert!(whole.answered > 3, "{name}: {} calls", whole.answered);
    for calls in 0..whole.answered {
        let done = interrupted(case, calls);
        let (resumed, before) = (essence(&done), essence(&reference));
        assert!(resumed == before, "{name}, interrupted after {calls} calls: {} {}", done.csv, reference.csv);
        assert_eq!(done.summary.runs, reference.summary.runs, "{name}, interrupted after {calls} calls");
    }
}

#[test]
fn a_run_that_is_killed_at_every_analysis_still_ends_with_the_same_bytes() {
    let case = windkessel("points = \"star\"\npasses = 2", 3, "");
    let reference = case.run_on(&mut InProcess::new(1)).unwrap();
    let path = case.fresh();
    // Two calls are one analysis: the ensemble, and its second observation after resampling.
    let lives = (1..200).find_map(|life| case.go(&path, &mut Mortal::new(2)).ok().map(|done| (life, done)));
    let (lives, done) = lives.unwrap();
    assert!(lives > 15, "{lives}");
    assert!(essence(&done) == essence(&reference));
}

/// A study with a held-out span, record and channel; the numbers are those of the held-out values.
fn with_secrets(estimator: &str, span: f64, record: f64, channel: f64) -> Done {
    let (times, z) = linear::data(40, 3);
    let one: Vec<f64> = (0..40).map(|i| if (5..=24).contains(&i) { z[i] } else { span + z[i] }).collect();
    let side: Vec<f64> = z.iter().map(|z| channel + 2.0 * z).collect();
    // The first value stays: a held-out record starts from it.
    let two: Vec<f64> = times.iter().zip(&z).map(|(t, z)| record * t + z).collect();
    let study = linear::study_of(
        estimator,
        r#"
[[records]]
name = "one"
file = "one.csv"
train = [0.45, 2.45]
channels = [ { column = "y", output = "y", noise = "auto" }, { column = "side", output = "twice", noise = 0.3 } ]
[[records]]
name = "two"
file = "two.csv"
use = "held-out"
channels = [ { column = "y", output = "y", noise = 0.1 } ]
[explain]
hold_out_channels = ["twice"]
"#,
    )
    .replace(
        r#"[ { name = "y", value = "x" } ]"#,
        r#"[ { name = "y", value = "x" }, { name = "twice", value = "2*x" } ]"#,
    )
    .replace(r#""linear", median = 0.3"#, r#""linear", median_from = "y""#);
    study_kit::run_once(
        &study,
        &[
            ("one.csv", csv("time,y,side", &[&times, &one, &side])),
            ("two.csv", csv("time,y", &[&times, &two])),
        ],
    )
}

#[test]
fn held_out_values_change_the_held_out_error_and_nothing_else() {
    for estimator in ["passes = 2", "points = \"star\"\npasses = 1", "kind = \"batch\""] {
        let calm = with_secrets(estimator, 0.0, 0.0, 0.0);
        let fit = |done: &Done, i: usize| done.summary.fit.channels[i].clone();
        for (span, record, channel) in [(50.0, 0.0, 0.0), (0.0, 70.0, 0.0), (0.0, 0.0, 90.0)] {
            let loud = with_secrets(estimator, span, record, channel);
            assert_eq!(loud.csv, calm.csv, "{estimator}: the posterior saw {span} {record} {channel}");
            let figures = |done: &Done| {
                let fit = &done.summary.fit;
                [fit.nis_per_observation, fit.log_likelihood].map(f64::to_bits)
            };
            assert_eq!(figures(&loud), figures(&calm));
            assert_eq!(fit(&loud, 0).train_rmse, fit(&calm, 0).train_rmse);
            let touched = usize::from(channel > 0.0);
            let rmse = fit(&loud, touched).held_out_rmse.unwrap();
            assert!(rmse > 20.0 && rmse > 10.0 * fit(&calm, touched).held_out_rmse.unwrap(), "{rmse}");
            assert_eq!(fit(&loud, 1 - touched).held_out_rmse, fit(&calm, 1 - touched).held_out_rmse);
        }
        assert_eq!(fit(&calm, 1).train_rmse, None, "a held-out channel trains nowhere");
    }
}
