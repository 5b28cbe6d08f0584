//! Twin experiments: data simulated from a known truth, and the result of the run.
#![allow(clippy::unwrap_used)]
mod study_kit;

use starlings_coordinator::study::twin::{Twin, simulate};
use starlings_estimators::nis_band;
use study_kit::{Case, Done, csv, grid, normals, run_once};

const TRUTH: [(&str, f64); 4] = [("R", 1.4), ("C", 1.2), ("Zc", 0.15), ("initial:p", 84.0)];

/// A three-element Windkessel over two beats, prior medians by name.
fn aorta(medians: [f64; 4], noise: f64, settings: &str) -> String {
    format!(
        r#"
[study]
name = "aorta"
[model]
kind = "windkessel-3"
[[parameters]]
name = "R"
prior = {{ transform = "log", median = {}, factor = 1.5 }}
[[parameters]]
name = "C"
prior = {{ transform = "log", median = {}, factor = 1.5 }}
[[parameters]]
name = "Zc"
prior = {{ transform = "log", median = {}, factor = 1.5 }}
[[parameters]]
name = "initial:p"
prior = {{ transform = "linear", median = {}, sd = 10.0 }}
[[records]]
name = "one"
file = "aorta.csv"
inputs = {{ flow = "flow" }}
channels = [ {{ column = "pressure", output = "pressure", noise = {noise} }} ]
{settings}
"#,
        medians[0], medians[1], medians[2], medians[3]
    )
}

/// The twin's recording: the truth with this noise.
fn recording(noise: f64, seed: u64) -> String {
    let times = grid(161, 0.01);
    let flow: Vec<f64> = times.iter().map(|t| 300.0 * (7.8 * (t % 0.8)).sin().max(0.0)).collect();
    let blank = csv("time,pressure,flow", &[&times, &vec![0.0; times.len()], &flow]);
    let study = Case::new(&aorta([1.0, 1.0, 0.1, 80.0], 1.0, ""), &[("aorta.csv", blank)]).study();
    let values = TRUTH.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let twin = simulate(&study, &Twin { values, noise, seed, ..Twin::default() }).unwrap();
    assert_eq!(twin.columns, ["pressure", "flow"]);
    csv("time,pressure,flow", &[&twin.times, &twin.values[0], &twin.values[1]])
}

fn fit(medians: [f64; 4], stated: f64, made: f64, seed: u64, settings: &str) -> Done {
    run_once(&aorta(medians, stated, settings), &[("aorta.csv", recording(made, seed))])
}

fn nudged(gain: f64) -> String {
    format!("[observer]\nkind = \"nudging\"\ngain = {gain}\n")
}

const MEDIANS: [f64; 4] = [1.4, 1.2, 0.15, 84.0];
const ELSEWHERE: [f64; 4] = [1.0, 1.0, 0.1, 80.0];
const GAINS: [f64; 5] = [0.0, 0.5, 3.0, 20.0, 1e3];

#[test]
fn a_fit_that_starts_at_the_truth_of_noise_free_data_stays_there_at_any_gain() {
    for gain in GAINS {
        let done = fit(MEDIANS, 0.5, 0.0, 0, &format!("{}[estimator]\nkind = \"batch\"", nudged(gain)));
        for (name, truth) in TRUTH {
            let p = done.estimate(name);
            // The slope along curved directions is measured between points a tenth of an sd apart, the residual is zero.
            assert!((p.estimate - truth).abs() < 1e-9 * truth, "gain {gain}: {name} {}", p.estimate);
        }
    }
}

#[test]
fn noise_free_data_give_the_truth_at_any_gain() {
    for gain in GAINS {
        for estimator in ["passes = 4\nspread = 1e-3", "passes = 4\npoints = \"star\"\nspread = 1e-3"] {
            let done = fit(ELSEWHERE, 0.5, 0.0, 0, &format!("{}[estimator]\n{estimator}", nudged(gain)));
            for (name, truth) in TRUTH {
                let p = done.estimate(name);
                // What the prior pulls: it is one to two prior sd off, so by (sd / prior sd)² of that, far below one sd.
                assert!(
                    (p.estimate - truth).abs() < 0.3 * p.sd,
                    "gain {gain}, {estimator}: {name} {} ± {}",
                    p.estimate,
                    p.sd
                );
            }
        }
    }
}

#[test]
fn the_nis_of_a_right_model_at_the_right_noise_lies_in_its_band() {
    for (estimator, seed) in
        [("passes = 2", 1), ("passes = 2\npoints = \"star\"", 2), ("passes = 3", 3), ("kind = \"batch\"", 4)]
    {
        let done = fit(ELSEWHERE, 1.5, 1.5, seed, &format!("[estimator]\n{estimator}"));
        let (lo, hi) = nis_band(161, 0.999);
        let nis = done.summary.fit.nis_per_observation;
        assert!(lo < nis && nis < hi, "{estimator}: {nis} is not in {lo} to {hi}");
        assert!(!done.warns("NIS"), "{:?}", done.summary.warnings);
        for (name, truth) in TRUTH {
            let p = done.estimate(name);
            // Sixteen estimates: one in a hundred such tests has one beyond 3.5 sd.
            assert!((p.estimate - truth).abs() < 3.5 * p.sd, "{estimator}: {name} {} ± {}", p.estimate, p.sd);
        }
    }
}

#[test]
fn noise_stated_three_times_too_small_or_too_large_raises_the_warning_of_its_side() {
    for estimator in ["passes = 2", "points = \"star\"", "kind = \"batch\""] {
        let settings = format!("[estimator]\n{estimator}");
        let small = fit(ELSEWHERE, 0.5, 1.5, 5, &settings);
        assert!(small.warns("far above 1"), "{estimator}: {:?}", small.summary.warnings);
        assert!(!small.warns("far below 1"));
        let large = fit(ELSEWHERE, 4.5, 1.5, 5, &settings);
        assert!(large.warns("far below 1"), "{estimator}: {:?}", large.summary.warnings);
        assert!(!large.warns("far above 1"));
    }
}

/// y = GAIN · F with a gain written by the caller, F a sine.
fn gauge(gain: &str, parameters: &str, settings: &str, truth: impl Fn(f64) -> f64) -> Done {
    let times = grid(120, 0.1);
    let drive: Vec<f64> = times.iter().map(|t| (1.3 * t).sin()).collect();
    let noise = normals(times.len(), 12);
    let y: Vec<f64> = (0..120).map(|i| truth(times[i]) * drive[i] + 0.05 * noise[i]).collect();
    let study = format!(
        r#"
[study]
name = "gauge"
[model]
kind = "equations"
outputs = [ {{ name = "y", value = "x + ({gain})*F" }} ]
inputs = [ {{ name = "F" }} ]
[[model.states]]
name = "x"
initial = 0.0
rate = "-x"
{parameters}
[[records]]
name = "one"
file = "gauge.csv"
inputs = {{ F = "F" }}
channels = [ {{ column = "y", output = "y", noise = 0.05 }} ]
[estimator]
{settings}
"#
    );
    run_once(&study, &[("gauge.csv", csv("time,y,F", &[&times, &y, &drive]))])
}

fn parameter(name: &str, median: f64, more: &str) -> String {
    format!(
        "[[parameters]]\nname = \"{name}\"\nprior = {{ transform = \"log\", median = {median}, factor = 2.0 }}\n{more}\n"
    )
}

#[test]
fn a_drifting_parameter_follows_a_jump_that_a_fixed_one_averages() {
    let jump = |t: f64| if t < 6.0 { 1.0 } else { 2.0 };
    let at_the_end = |process: &str| {
        let done = gauge("g", &parameter("g", 1.0, process), "", jump);
        let rows = done.table("estimates", "step, estimate");
        let before: f64 = rows[55][1].parse().unwrap();
        (before, done.estimate("g").estimate, done.estimate("g").sd)
    };
    for process in
        ["process = { forgetting = 0.9 }", "process = { forgetting = 0.8 }", "process = { walk = 0.1 }"]
    {
        let (before, after, sd) = at_the_end(process);
        // Ten remembered samples of a sine know the gain to about 0.02.
        assert!(
            (before - 1.0).abs() < 0.1 && (after - 2.0).abs() < 0.2,
            "{process}: {before} {after} ± {sd}"
        );
        assert!(sd > 0.01, "{process}: a parameter that may move is never known exactly, ± {sd}");
    }
    let batch = gauge("g", &parameter("g", 1.0, "process = { walk = 0.1 }"), "kind = \"batch\"", jump);
    assert!(batch.warns("the batch fit holds g at one value"), "{:?}", batch.summary.warnings);
    let (_, fixed, sd) = at_the_end("");
    assert!((1.2..1.8).contains(&fixed) && sd < 0.01, "without drift the mean of both: {fixed} ± {sd}");
}

#[test]
fn two_parameters_that_enter_as_a_product_are_reported_as_one_combination() {
    for estimator in ["passes = 2", "points = \"star\"", "kind = \"batch\""] {
        let both = parameter("a", 1.0, "") + &parameter("b", 1.5, "");
        let done = gauge("a*b", &both, estimator, |_| 2.0);
        assert!(done.warns("a and b are correlated"), "{estimator}: {:?}", done.summary.warnings);
        let product = done.estimate("a").estimate * done.estimate("b").estimate;
        assert!((product - 2.0).abs() < 0.05, "{estimator}: their product is known: {product}");
        let apart = gauge("a", &parameter("a", 1.0, ""), estimator, |_| 2.0);
        assert!(!apart.warns("correlated ("), "{:?}", apart.summary.warnings);
    }
}

#[test]
fn a_parameter_that_does_not_matter_is_said_to_be_unknown() {
    // A single pass of the simplex over a wide prior mistakes the curvature in one parameter for a slope in the other.
    for estimator in ["passes = 2", "passes = 1\npoints = \"star\"", "points = \"star\"", "kind = \"batch\""]
    {
        let both = parameter("a", 1.0, "") + &parameter("idle", 1.5, "");
        let done = gauge("a + 0*idle", &both, estimator, |_| 2.0);
        assert!(done.warns("almost nothing about idle"), "{estimator}: {:?}", done.summary.warnings);
        assert!(!done.warns("almost nothing about a:"), "{:?}", done.summary.warnings);
        let idle = done.estimate("idle");
        // No information: the posterior is the prior, up to what the curvature along the other parameter adds.
        let sd = 2f64.ln();
        assert!((idle.estimate / 1.5).ln().abs() < 0.01 * sd, "{estimator}: {}", idle.estimate);
        assert!((idle.interval95[1] / idle.prior_interval95[1]).ln().abs() < 0.02 * sd, "{estimator}");
    }
}
