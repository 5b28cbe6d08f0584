//! Several records in one study: shared and own parameters, unequal lengths, whole records held out.
#![allow(clippy::unwrap_used)]
mod study_kit;

use nalgebra::{DMatrix, DVector};
use study_kit::linear::{self, A, B, Regression, START, assert_exact, value};
use study_kit::{Done, grid, normals, run_once};

/// Times, noise and truth of three records: b is shared, a and x0 are their own.
const LENGTHS: [usize; 3] = [31, 22, 13];
const NOISES: [f64; 3] = [0.1, 0.3, 0.05];
const OWN_A: [f64; 3] = [1.1, 0.4, 0.9];
const OWN_START: [f64; 3] = [0.1, -0.4, 0.6];
const SHARED_B: f64 = -0.7;

fn recording(i: usize) -> (Vec<f64>, Vec<f64>) {
    let times = grid(LENGTHS[i], 0.1 + 0.03 * i as f64);
    let theta = [OWN_A[i], SHARED_B, OWN_START[i]];
    let noise = normals(LENGTHS[i], 40 + i as u64);
    let z = times.iter().zip(noise).map(|(t, e)| value(theta, *t) + NOISES[i] * e).collect();
    (times, z)
}

fn joint(estimator: &str, more: [&str; 3]) -> Done {
    let names = [("one", "one.csv"), ("two", "two.csv"), ("three", "three.csv")];
    let records: String =
        (0..3).map(|i| linear::record(names[i].0, names[i].1, NOISES[i], more[i])).collect();
    let study =
        linear::study_of(estimator, &records).replacen("name = \"a\"", "name = \"a\"\nper_record = true", 1);
    let files: Vec<(&str, String)> = (0..3)
        .map(|i| {
            let (times, z) = recording(i);
            (names[i].1, linear::file(&times, &z))
        })
        .collect();
    run_once(&study, &files)
}

/// The records stacked by hand; columns a per record, b, x0 per record.
fn stacked(records: &[usize]) -> linear::Answer {
    let n = records.len();
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let (mut z, mut noise) = (Vec::new(), Vec::new());
    for (k, &i) in records.iter().enumerate() {
        let (times, values) = recording(i);
        for (t, value) in times.into_iter().zip(values) {
            let mut row = vec![0.0; 2 * n + 1];
            row[k] = t;
            row[n] = 0.5 * t * t;
            row[n + 1 + k] = 1.0;
            rows.push(row);
            z.push(value);
            noise.push(NOISES[i]);
        }
    }
    let per = |own: f64, shared: f64, start: f64| {
        let mut v = vec![own; n];
        v.push(shared);
        v.extend(vec![start; n]);
        DVector::from_vec(v)
    };
    Regression {
        h: DMatrix::from_fn(rows.len(), 2 * n + 1, |i, j| rows[i][j]),
        z: DVector::from_vec(z),
        noise: DVector::from_vec(noise),
        mean: per(A.0, B.0, START.0),
        sd: per(A.1, B.1, START.1),
    }
    .solve()
}

#[test]
fn a_joint_fit_is_the_regression_of_the_stacked_records() {
    let answer = stacked(&[0, 1, 2]);
    for (estimator, every) in [
        ("passes = 1", ["", "", ""]),
        ("passes = 2", ["every = 5", "", "every = 2"]),
        ("points = \"star\"\npasses = 2", ["", "", ""]),
        ("points = \"star\"\npasses = 1", ["every = 5", "", "every = 2"]),
        ("kind = \"batch\"", ["", "", ""]),
        ("kind = \"gauss-newton\"", ["", "", ""]),
    ] {
        let done = joint(estimator, every);
        let names: Vec<&str> = done.summary.parameters.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(
            names,
            ["a[one]", "a[two]", "a[three]", "b", "initial:x[one]", "initial:x[two]", "initial:x[three]"]
        );
        // Roundings of sixty analyses and the integrator.
        assert_exact(&done, &answer, 1e-6, estimator);
    }
}

#[test]
fn a_held_out_record_is_predicted_with_the_mean_of_the_others_and_its_own_prior_start() {
    for estimator in ["passes = 2", "kind = \"batch\"", "kind = \"gauss-newton\""] {
        let done = joint(estimator, ["", "use = \"held-out\"", ""]);
        assert_exact(&done, &stacked(&[0, 2]), 1e-6, estimator);
        let estimate = |name: &str| done.estimate(name).estimate;
        let theta = [0.5 * (estimate("a[one]") + estimate("a[three]")), estimate("b"), START.0];
        let predicted = done.predicted("two");
        assert_eq!(predicted.len(), LENGTHS[1]);
        for (t, y) in predicted {
            // The integrator's tolerance.
            assert!((y - value(theta, t)).abs() < 1e-6, "{y} at {t}");
        }
        let fit = &done.summary.fit;
        let of = |name: &str| fit.records.iter().find(|r| r.record == name).unwrap().channels[0].clone();
        assert!(of("two").train_rmse.is_none() && of("two").held_out_rmse.is_some());
        assert!(of("one").train_rmse.is_some() && of("one").held_out_rmse.is_none());
        let jobs = done.table("jobs", "pass, record");
        assert!(jobs.iter().all(|row| row[1] != "two" || row[0] == "0"), "only the final run sees it");
    }
}

#[test]
fn a_record_that_ends_early_leaves_the_others_running() {
    let done = joint("passes = 1", ["", "", ""]);
    let steps = done.table("analyses", "step, n_used");
    let used: Vec<u32> = steps.iter().map(|row| row[1].parse().unwrap()).collect();
    assert_eq!(used.len(), LENGTHS[0]);
    for (step, used) in used.into_iter().enumerate() {
        assert_eq!(used as usize, LENGTHS.iter().filter(|n| **n > step).count(), "step {step}");
    }
    let total: usize = LENGTHS.iter().map(|n| n * 8).sum();
    assert_eq!(done.summary.runs.total, total as u64, "p + 1 = 8 particles, one job per record and window");
}

#[test]
fn a_batch_fit_makes_no_run_of_a_record_for_the_values_of_another() {
    let done = joint("kind = \"batch\"", ["", "", ""]);
    let jobs = done.table("jobs", "pass, step");
    let ensembles = done.table("analyses", "step").len();
    let of_fit = jobs.iter().filter(|row| row[0] == "1").count();
    // a, b and x0 of one record take four simplex points and their centre, though seven values are estimated.
    assert_eq!(of_fit, ensembles * 3 * 5);
    assert_eq!(done.summary.runs.total, of_fit as u64, "the runs of the fit");
}
