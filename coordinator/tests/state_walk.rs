//! A state that walks: the filter beside a Kalman filter of all states with that noise, and what is refused.
#![allow(clippy::unwrap_used)]
mod study_kit;

use nalgebra::{DMatrix, DVector};
use starlings_coordinator::study::identify::At;
use study_kit::linear::{self, A, Answer, B, NOISE, START, assert_exact};
use study_kit::{Case, csv, grid, normals, run_once};

/// Roundings of a few dozen analyses.
const TOLERANCE: f64 = 1e-9;

/// A linear system between analyses, observed in its first state.
struct Kalman {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Variances that are added between two analyses.
    walk: DVector<f64>,
    evidence: f64,
    nis: f64,
}

impl Kalman {
    fn new(mean: &[f64], sd: &[f64], walk: &[f64]) -> Self {
        Self {
            mean: DVector::from_column_slice(mean),
            covariance: DMatrix::from_diagonal(&DVector::from_column_slice(sd).map(|s| s * s)),
            walk: DVector::from_column_slice(walk).map(|s| s * s),
            evidence: 0.0,
            nis: 0.0,
        }
    }

    /// From one analysis to the next.
    fn predict(&mut self, step: &DMatrix<f64>) {
        self.covariance += DMatrix::from_diagonal(&self.walk);
        self.mean = step * &self.mean;
        self.covariance = step * &self.covariance * step.transpose();
    }

    fn observe(&mut self, h: &[f64], z: f64, noise: f64) {
        let h = DVector::from_column_slice(h);
        let gain = &self.covariance * &h;
        let (variance, innovation) = (h.dot(&gain) + noise * noise, z - h.dot(&self.mean));
        self.evidence -= 0.5 * ((std::f64::consts::TAU * variance).ln() + innovation * innovation / variance);
        self.nis += innovation * innovation / variance;
        self.mean += &gain * (innovation / variance);
        self.covariance -= &gain * gain.transpose() / variance;
    }

    fn answer(self) -> Answer {
        Answer { mean: self.mean, covariance: self.covariance, evidence: self.evidence }
    }
}

/// The line of the linear kit, whose state walks.
fn walking(estimator: &str, records: &str) -> String {
    let sd = format!("sd = {} }}", START.1);
    let study = linear::study_of(estimator, records);
    let (before, after) = study.rsplit_once(&sd).unwrap();
    format!("{before}{sd}\nprocess = {{ walk = 0.2 }}{after}")
}

/// x' = a + b t with state noise on x: the vector (a, b, x).
fn of_the_line(times: &[f64], z: &[f64]) -> Kalman {
    let mut kalman = Kalman::new(&[A.0, B.0, START.0], &[A.1, B.1, START.1], &[0.0, 0.0, 0.2]);
    let mut before = times[0];
    for (t, z) in times.iter().zip(z) {
        let step = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, t - before, 0.5 * (t * t - before * before), 1.0];
        if *t > times[0] {
            kalman.predict(&DMatrix::from_row_slice(3, 3, &step));
        }
        kalman.observe(&[0.0, 0.0, 1.0], *z, NOISE);
        before = *t;
    }
    kalman
}

#[test]
fn a_state_that_walks_beside_parameters_is_the_kalman_filter_with_state_noise() {
    let (times, z) = linear::data(30, 1);
    let answer = of_the_line(&times, &z).answer();
    for points in ["simplex", "canonical", "star", "julier-uhlmann"] {
        let study = walking(
            &format!("points = \"{points}\"\npasses = 1\nresample = \"none\""),
            &linear::record("one", "line.csv", NOISE, ""),
        );
        let done = run_once(&study, &[("line.csv", linear::file(&times, &z))]);
        assert_exact(&done, &answer, TOLERANCE, points);
        assert!(done.summary.conditional_on.contains("States walk"), "{}", done.summary.conditional_on);
    }
    // Without the noise the answer is another one: the test can fail.
    let still = linear::Regression::of_record(&times, &z).solve();
    assert!((still.mean[2] - answer.mean[2]).abs() > 0.1);
}

#[test]
fn evidence_and_nis_are_those_under_the_own_prior_wherever_the_pass_with_drift_starts() {
    let (times, z) = linear::data(30, 1);
    let kalman = of_the_line(&times, &z);
    let nis = kalman.nis / times.len() as f64;
    let answer = kalman.answer();
    for estimator in ["passes = 1", "passes = 2", "", "anneal = 2.0", "points = \"star\""] {
        let study = walking(estimator, &linear::record("one", "line.csv", NOISE, ""));
        let done = run_once(&study, &[("line.csv", linear::file(&times, &z))]);
        // The start of the second pass is closer by the root of the data's weight there: it costs a digit or two.
        assert_exact(&done, &answer, 100.0 * TOLERANCE, estimator);
        let found = done.summary.fit.nis_per_observation;
        assert!((found - nis).abs() < 100.0 * TOLERANCE * nis, "{estimator}: {found} {nis}");
        assert!(!done.warns("does not explain the data"), "{:?}", done.summary.warnings);
    }
}

/// A level that walks, seen by itself.
const LEVEL: &str = r#"
[study]
name = "level"
[model]
kind = "equations"
outputs = [ { name = "y", value = "a" } ]
[[model.states]]
name = "still"
initial = 0.0
rate = "-still"
[[parameters]]
name = "a"
prior = { transform = "linear", median = 75.0, sd = 8.0 }
process = { walk = 1.0 }
"#;

#[test]
fn a_parameter_that_walks_is_known_as_after_its_last_analysis_also_of_the_shorter_of_two_records() {
    let (long, short) = (grid(40, 0.1), grid(25, 0.1));
    let course = |times: &[f64], seed: u64| {
        let (mut level, noise) = (80.0, normals(times.len(), seed + 1));
        let walk = normals(times.len(), seed);
        let z = walk.iter().zip(noise).map(|(step, e)| {
            level += step;
            level + e
        });
        z.collect::<Vec<f64>>()
    };
    let of = |times: &[f64], z: &[f64]| {
        let mut kalman = Kalman::new(&[75.0], &[8.0], &[1.0]);
        for (k, z) in z.iter().enumerate() {
            if k > 0 {
                kalman.predict(&DMatrix::identity(1, 1));
            }
            kalman.observe(&[1.0], *z, 1.0);
        }
        assert_eq!(times.len(), z.len());
        kalman
    };
    let (z, other) = (course(&long, 1), course(&short, 3));
    let one = of(&long, &z).answer();
    let two = of(&short, &other).answer();
    let both = Answer {
        mean: DVector::from_vec(vec![one.mean[0], two.mean[0]]),
        covariance: DMatrix::from_diagonal(&DVector::from_vec(vec![
            one.covariance[(0, 0)],
            two.covariance[(0, 0)],
        ])),
        evidence: one.evidence + two.evidence,
    };
    let records = linear::record("one", "long.csv", 1.0, "") + &linear::record("two", "short.csv", 1.0, "");
    let files = [("long.csv", linear::file(&long, &z)), ("short.csv", linear::file(&short, &other))];
    for passes in [1, 2] {
        let end = format!("[estimator]\npasses = {passes}\n");
        let alone = LEVEL.to_owned() + &linear::record("one", "long.csv", 1.0, "") + &end;
        assert_exact(&run_once(&alone, &files[..1]), &one, 100.0 * TOLERANCE, "one record");
        let each = LEVEL.replace("process =", "per_record = true\nprocess =") + &records + &end;
        assert_exact(&run_once(&each, &files), &both, 100.0 * TOLERANCE, "two records");
    }
}

/// Position of an undamped oscillator of circular frequency 3, every 0.1 s.
const OSCILLATOR: &str = r#"
[study]
name = "oscillator"
[model]
kind = "oscillator"
constants = { m = 2.0, c = 0.0, k = 18.0 }
[[parameters]]
name = "initial:x"
prior = { transform = "linear", median = 0.5, sd = 0.4 }
[[parameters]]
name = "initial:v"
prior = { transform = "linear", median = 0.0, sd = 1.0 }
process = { walk = 0.3 }
[estimator]
passes = 1
[[records]]
name = "one"
file = "position.csv"
channels = [ { column = "x", output = "position", noise = 0.05 } ]
"#;

#[test]
fn noise_on_the_velocity_alone_is_the_kalman_filter_of_position_and_velocity() {
    let times = grid(40, 0.1);
    let z: Vec<f64> =
        times.iter().zip(normals(40, 5)).map(|(t, e)| 0.9 * (3.0 * t).cos() + 0.05 * e).collect();
    let (sin, cos) = 0.3_f64.sin_cos();
    let step = DMatrix::from_row_slice(2, 2, &[cos, sin / 3.0, -3.0 * sin, cos]);
    let mut kalman = Kalman::new(&[0.5, 0.0], &[0.4, 1.0], &[0.0, 0.3]);
    for (k, z) in z.iter().enumerate() {
        if k > 0 {
            kalman.predict(&step);
        }
        kalman.observe(&[1.0, 0.0], *z, 0.05);
    }
    let done = run_once(OSCILLATOR, &[("position.csv", csv("time,x", &[&times, &z]))]);
    assert_exact(&done, &kalman.answer(), TOLERANCE, "oscillator");
    // A free run begins where the pass began, not where the state ended.
    let first = done.predicted("one")[0].1;
    assert!((first - 0.5).abs() < 1e-12, "{first}");
}

#[test]
fn what_cannot_walk_is_refused_with_the_remedy() {
    let (times, z) = linear::data(30, 1);
    let one = linear::record("one", "line.csv", NOISE, "");
    let told = |study: &str| {
        let files =
            [("line.csv", linear::file(&times, &z)), ("short.csv", linear::file(&times[..20], &z[..20]))];
        Case::new(study, &files).refusal().unwrap_or_default()
    };
    assert_eq!(told(&walking("passes = 1", &one)), "");
    let batch = told(&walking("kind = \"batch\"", &one));
    assert!(
        batch.contains("a state cannot walk in a batch fit") && batch.contains("`kind = \"roukf\"`"),
        "{batch}"
    );
    let two = linear::record("one", "line.csv", NOISE, "") + &linear::record("two", "line.csv", NOISE, "");
    assert_eq!(told(&walking("passes = 1", &two)), "");
    let shared = walking("passes = 1", &two).replace("process =", "per_record = false\nprocess =");
    assert!(told(&shared).contains("the state of each walks by itself"), "{}", told(&shared));
    let unequal =
        linear::record("one", "line.csv", NOISE, "") + &linear::record("two", "short.csv", NOISE, "");
    let unequal = told(&walking("passes = 1", &unequal));
    assert!(unequal.contains("different numbers of them"), "{unequal}");
    let log = walking("passes = 1", &one).replace(
        &format!("transform = \"linear\", median = {}, sd = {}", START.0, START.1),
        "transform = \"log\", median = 0.3, factor = 2.0",
    );
    assert!(told(&log).contains("a state walks in its own unit"), "{}", told(&log));
    // Predictions begin at the start of a record, where the posterior of such a study says nothing.
    let predicted = walking("passes = 1", &one) + "[predict]\noutputs = [\"y\"]\n";
    assert!(told(&predicted).contains("and what is predicted begins at its start"), "{}", told(&predicted));
}

#[test]
fn what_begins_at_the_start_of_a_record_is_refused_at_the_posterior_of_a_state_that_walks() {
    let case = Case::new(
        &walking("passes = 1", &linear::record("one", "line.csv", NOISE, "")),
        &[("line.csv", linear::file(&grid(10, 0.1), &[0.3; 10]))],
    );
    let study = case.study();
    At::Prior.centre(&study).unwrap();
    let refused = At::Run(case.fresh()).centre(&study).unwrap_err().to_string();
    assert!(refused.contains("what is identified begins at its start: remove `process`"), "{refused}");
}

#[test]
fn what_is_asked_of_a_state_that_walks_is_asked_of_the_initial_values_beside_it() {
    let beside = OSCILLATOR.replace(
        "transform = \"linear\", median = 0.5, sd = 0.4",
        "transform = \"log\", median = 0.5, factor = 2.0",
    );
    let times = grid(40, 0.1);
    let told =
        Case::new(&beside, &[("position.csv", csv("time,x", &[&times, &[0.5; 40]]))]).refusal().unwrap();
    assert!(told.contains("the prior of `initial:x` is not linear"), "{told}");
}

#[test]
fn one_value_follows_the_record_that_is_fitted_wherever_it_stands() {
    let (times, z) = linear::data(30, 1);
    let held_out = linear::record("unseen", "line.csv", NOISE, "use = \"held-out\"\n");
    let one = linear::record("one", "line.csv", NOISE, "");
    let study = walking("passes = 1\nresample = \"none\"", &(held_out + &one))
        .replace("process =", "per_record = false\nprocess =");
    let done = run_once(&study, &[("line.csv", linear::file(&times, &z))]);
    assert_exact(&done, &of_the_line(&times, &z).answer(), TOLERANCE, "a record that is held out before it");
}

#[test]
fn where_a_state_has_gone_is_not_held_against_the_prior_of_its_start() {
    // From 0.3 ± 0.5 to far away.
    let times = grid(30, 0.1);
    let z: Vec<f64> = times.iter().map(|t| 0.3 + 10.0 * t).collect();
    let records = linear::record("one", "line.csv", NOISE, "");
    let study = walking("passes = 1\nresample = \"none\"", &records);
    let done = run_once(&study, &[("line.csv", linear::file(&times, &z))]);
    let of_start = |w: &&String| w.contains("initial:x is") && w.contains("from its prior median");
    assert_eq!(done.summary.warnings.iter().find(of_start), None);
    assert!(done.summary.parameters.iter().any(|p| p.name == "initial:x" && p.estimate > 20.0));
}
