//! On a problem linear in its parameters every way to fit is Bayesian linear regression, whatever its settings.
#![allow(clippy::unwrap_used)]
mod study_kit;

use study_kit::linear::{self, Regression, assert_exact};
use study_kit::{csv, grid, run_once};

/// Runs of the filter accumulate roundings of a few dozen analyses and of an integrator at 1e-8.
const TOLERANCE: f64 = 1e-6;

#[test]
fn one_two_or_three_passes_over_any_points_are_the_closed_form() {
    let (times, z) = linear::data(40, 1);
    let answer = Regression::of_record(&times, &z).solve();
    for points in ["simplex", "canonical", "star", "julier-uhlmann"] {
        for passes in [1, 2, 3] {
            let estimator = format!("points = \"{points}\"\npasses = {passes}");
            let done = run_once(&linear::study(&estimator), &[("line.csv", linear::file(&times, &z))]);
            assert_exact(&done, &answer, TOLERANCE, &estimator);
        }
    }
}

#[test]
fn annealing_spread_root_and_resampling_do_not_move_the_closed_form() {
    let (times, z) = linear::data(40, 2);
    let answer = Regression::of_record(&times, &z).solve();
    for settings in [
        "anneal = 1.0",
        "anneal = 100.0",
        "spread = 1.0",
        "spread = 0.1",
        "spread = 0.003",
        "root = \"cholesky\"",
        "points = \"star\"\nresample = \"none\"",
        "points = \"canonical\"\nspread = 0.1",
    ] {
        let done = run_once(
            &linear::study(&format!("passes = 2\n{settings}")),
            &[("line.csv", linear::file(&times, &z))],
        );
        assert_exact(&done, &answer, TOLERANCE, settings);
    }
}

#[test]
fn the_batch_fit_is_the_closed_form() {
    let (times, z) = linear::data(40, 3);
    let answer = Regression::of_record(&times, &z).solve();
    for points in ["simplex", "star"] {
        let study = linear::study(&format!("kind = \"batch\"\npoints = \"{points}\""));
        let done = run_once(&study, &[("line.csv", linear::file(&times, &z))]);
        assert_exact(&done, &answer, TOLERANCE, points);
    }
}

#[test]
fn missing_values_are_left_out_and_the_length_of_a_window_does_not_matter() {
    let (times, mut z) = linear::data(43, 4);
    for gap in [1, 7, 8, 9, 10, 30, 42] {
        z[gap] = f64::NAN;
    }
    let answer = Regression::of_record(&times, &z).solve();
    for every in [1, 5, 40, 1000] {
        for estimator in
            ["passes = 1", "passes = 2", "points = \"star\"", "kind = \"batch\"", "kind = \"gauss-newton\""]
        {
            let record = linear::record("one", "line.csv", linear::NOISE, &format!("every = {every}"));
            let done =
                run_once(&linear::study_of(estimator, &record), &[("line.csv", linear::file(&times, &z))]);
            assert_exact(&done, &answer, TOLERANCE, &format!("{estimator}, every {every}"));
        }
    }
}

#[test]
fn channels_sampled_at_different_times_count_each_with_its_own_noise() {
    let (times, z) = linear::data(36, 5);
    let sparse: Vec<f64> = (0..36).map(|i| if i % 4 == 1 { 2.0 * z[i] + 0.05 } else { f64::NAN }).collect();
    let mut first = z.clone();
    first[20] = f64::NAN;
    let mut problem = Regression::of_record(&times, &first);
    let other = Regression::of_record(&times, &sparse);
    let (m, n) = (problem.z.len(), other.z.len());
    problem.h = problem.h.resize_vertically(m + n, 0.0);
    problem.h.rows_mut(m, n).copy_from(&(other.h * 2.0));
    problem.z = problem.z.resize_vertically(m + n, 0.0);
    problem.z.rows_mut(m, n).copy_from(&other.z);
    problem.noise = problem.noise.resize_vertically(m + n, 0.4);
    let answer = problem.solve();
    for estimator in
        ["passes = 1", "passes = 2", "points = \"star\"", "kind = \"batch\"", "kind = \"gauss-newton\""]
    {
        for every in [1, 5] {
            let study = linear::study_of(
                estimator,
                &linear::record("one", "line.csv", linear::NOISE, &format!("every = {every}")),
            )
            .replace(r#""x" } ]"#, r#""x" }, { name = "twice", value = "2*x" } ]"#)
            .replace("noise = 0.1 }", r#"noise = 0.1 }, { column = "side", output = "twice", noise = 0.4 }"#);
            let file = csv("time,y,side", &[&times, &first, &sparse]);
            assert_exact(&run_once(&study, &[("line.csv", file)]), &answer, TOLERANCE, estimator);
        }
    }
}

/// A level that the model holds still while the data jump between 0 and 1, nudged so hard that the state becomes the datum.
fn jumping(estimator: &str) -> Vec<f64> {
    let times = grid(12, 1.0);
    let z: Vec<f64> = (0..12).map(|i| f64::from(i % 2)).collect();
    let study = linear::study(estimator)
        .replace("median = 0.5, sd = 1", "median = 0.0, sd = 1e-7")
        .replace("median = -0.2, sd = 0.8", "median = 0.0, sd = 1e-7")
        .replace("median = 0.3, sd = 0.5", "median = 0.0, sd = 1e-7")
        + "[observer]\nkind = \"nudging\"\ngain = 1e3\ncorrects = { y = \"x\" }\n";
    let done = run_once(&study, &[("line.csv", linear::file(&times, &z))]);
    let rows = done.table("innovations", "pass, innovation");
    let last = rows.last().unwrap()[0].clone();
    rows.into_iter().filter(|row| row[0] == last).map(|row| row[1].parse().unwrap()).collect()
}

#[test]
fn an_innovation_is_recorded_before_the_observer_sees_its_datum() {
    for estimator in [
        "passes = 1",
        "passes = 2",
        "points = \"star\"\npasses = 1",
        "points = \"canonical\"\npasses = 1\nresample = \"none\"",
    ] {
        let innovations = jumping(estimator);
        assert_eq!(innovations.len(), 12);
        // The state at one time is the datum of the time before: the innovation is the jump between them. The parameters are
        // free by 1e-7 and enter with t², at most 72.
        for (k, innovation) in innovations.into_iter().enumerate() {
            let jump = if k == 0 { 0.0 } else { 2.0 * f64::from(k as u32 % 2) - 1.0 };
            assert!((innovation - jump).abs() < 1e-3, "{estimator}: {innovation} at {k}");
        }
    }
}
