//! When passes end, the warning where they do not settle, and which constant an answer hangs on.
#![allow(clippy::unwrap_used)]
mod study_kit;

use study_kit::linear::{self, Regression, assert_exact};
use study_kit::{Done, csv, grid, normals, rcr, run_once};

fn passes(done: &Done) -> usize {
    done.table("analyses", "pass").iter().map(|row| row[0].parse().unwrap()).max().unwrap()
}

#[test]
fn a_linear_problem_settles_with_the_third_pass_at_the_closed_form() {
    let (times, z) = linear::data(40, 5);
    let answer = Regression::of_record(&times, &z).solve();
    for points in ["simplex", "star"] {
        let study = linear::study(&format!("points = \"{points}\""));
        let done = run_once(&study, &[("line.csv", linear::file(&times, &z))]);
        // The annealed pass, one that finds the answer, one that does not move it; roundings as of a fixed number.
        assert_exact(&done, &answer, 1e-6, points);
        assert_eq!(passes(&done), 3, "{points}");
        assert_eq!(done.summary.estimator, format!("roukf, {points} points, 3 passes"));
        assert!(!done.warns("still moved") && !done.warns("free run"), "{:?}", done.summary.warnings);
    }
}

#[test]
fn a_fixed_number_of_passes_is_warned_of_by_the_same_measure() {
    let done = run_once(&rcr::study(2.0, "passes = 2"), &rcr::files(2.0, 1));
    assert_eq!(passes(&done), 2);
    let told = done.summary.warnings.iter().find(|w| w.contains("still moved")).unwrap();
    assert!(told.starts_with("the last pass, number 2, still moved "), "{told}");
    assert!(
        told.ends_with(
            " posterior standard deviations: whether the estimate has settled is not known. Leave out [estimator] passes, \
             and there are as many as it takes."
        ),
        "{told}"
    );
    let settled = run_once(&rcr::study(2.0, ""), &rcr::files(2.0, 1));
    assert!(!settled.warns("still moved"), "{:?}", settled.summary.warnings);
}

/// Largest distance of Zc, R, C from the truth, and of the estimates from those of the batch fit, in posterior sd.
fn distances(done: &Done, best: &Done) -> (f64, f64) {
    let truth = |(p, truth): (&starlings_coordinator::study::posterior::Estimate, f64)| {
        (p.estimate - truth).abs() / p.sd
    };
    let far = done.summary.parameters.iter().zip(rcr::TRUTH).map(truth).fold(0.0, f64::max);
    let pairs = done.summary.parameters.iter().zip(&best.summary.parameters);
    (far, pairs.map(|(a, b)| (a.estimate - b.estimate).abs() / b.sd).fold(0.0, f64::max))
}

#[test]
fn nearly_noise_free_data_are_fitted_to_the_best_by_any_points_and_a_single_pass_is_right_or_warned_of() {
    let files = rcr::files(0.01, 3);
    let best = run_once(&rcr::study(0.01, "kind = \"batch\""), &files);
    for points in ["simplex", "canonical", "star"] {
        let settled = run_once(&rcr::study(0.01, &format!("points = \"{points}\"")), &files);
        let (_, off) = distances(&settled, &best);
        // Settled is a last move below 0.1 sd; the batch fit ends within 0.01.
        assert!(off < 0.2, "{points}: {off} sd from the best; {:?}", settled.summary.warnings);
        assert!(
            !settled.warns("still moved") && !settled.warns("free run"),
            "{:?}",
            settled.summary.warnings
        );
        let once = run_once(&rcr::study(0.01, &format!("points = \"{points}\"\npasses = 1")), &files);
        let (_, off) = distances(&once, &best);
        let told =
            once.warns("a free run with the estimate misses the training data by") || once.warns("NIS is");
        assert!(off < 1.0 || told, "{points}: {off} sd from the best, {:?}", once.summary.warnings);
    }
}

/// A gauge whose reading is `value`, with one estimated factor `a` and a constant `c` = 2.
fn gauge(value: &str, truth: impl Fn(f64) -> f64, noise: f64) -> Done {
    let times = grid(81, 0.1);
    let y: Vec<f64> = times.iter().zip(normals(81, 7)).map(|(t, e)| truth(*t) + noise * e).collect();
    let study = format!(
        r#"
[study]
name = "gauge"
[model]
kind = "equations"
outputs = [ {{ name = "y", value = "{value} + 0*x" }} ]
constants = {{ c = 2.0, idle = 1.0, nothing = 0.0 }}
[[model.states]]
name = "x"
initial = 0.0
rate = "-x + 0*c + 0*idle + 0*nothing"
[[parameters]]
name = "a"
prior = {{ transform = "linear", median = 1.0, sd = 0.5 }}
[[records]]
name = "one"
file = "gauge.csv"
channels = [ {{ column = "y", output = "y", noise = {noise} }} ]
"#
    );
    run_once(&study, &[("gauge.csv", csv("time,y", &[&times, &y]))])
}

#[test]
fn an_estimate_hangs_on_the_constant_that_it_is_multiplied_with() {
    let done = gauge("a*c*sin(t)", |t| 2.4 * t.sin(), 0.05);
    let found = done.summary.hangs_on.as_ref().unwrap();
    let a = done.estimate("a");
    // a c is known: one per cent more of c is one per cent less of a. The step is a whole per cent, and the prior holds
    // a thousandth.
    let want = -0.01 * a.estimate / a.sd;
    let most = &found.constants[0];
    assert_eq!((most.constant.as_str(), most.moves[0].parameter.as_str()), ("c", "a"));
    assert!((most.moves[0].sd_per_percent / want - 1.0).abs() < 0.01, "{:?} against {want}", most.moves);
    assert_eq!(most.sentence(), format!("a moves by {:.1} posterior sd when c is 1 % off", want.abs()));
    let idle = found.constants.iter().find(|c| c.constant == "idle").unwrap();
    assert!(idle.largest() < 1e-9, "{idle:?}");
    assert_eq!(found.not_tried, ["nothing"]);
    // Two points, one run as it is, two constants that are not zero.
    assert_eq!(found.runs, 5);
}
