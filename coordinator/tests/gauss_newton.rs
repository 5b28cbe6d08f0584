//! Gauss–Newton with exact slopes finds what the batch fit with sigma points finds, with a run per record and iteration.
#![allow(clippy::unwrap_used)]
mod study_kit;

use starlings_coordinator::study::trial::{Depth, dry_run};
use starlings_estimators::{BATCH, GAUSS_NEWTON};
use study_kit::{Case, Done, csv, grid, normals, run_once};

/// x'' = −k x − c v − d |v| v, from a start of each record's own: the predictions are not linear in any of them.
fn study(estimator: &str, rate: &str) -> String {
    let parameter = |(name, median, factor): (&str, f64, f64)| {
        format!(
            "[[parameters]]\nname = \"{name}\"\nprior = {{ transform = \"log\", median = {median}, factor = {factor} }}\n"
        )
    };
    let parameters: String =
        [("k", 3.0, 1.5), ("c", 0.2, 3.0), ("d", 0.1, 3.0)].into_iter().map(parameter).collect();
    let record = |name: &str| {
        format!(
            "[[records]]\nname = \"{name}\"\nfile = \"{name}.csv\"\nchannels = [{{ column = \"y\", output = \"y\", noise = 0.02 }}]\n"
        )
    };
    format!(
        r#"
[study]
name = "swing"
[model]
kind = "equations"
outputs = [ {{ name = "y", value = "x" }} ]
[[model.states]]
name = "x"
initial = 1.0
rate = "v"
[[model.states]]
name = "v"
initial = 0.0
rate = "{rate}"
{parameters}
[[parameters]]
name = "initial:x"
per_record = true
prior = {{ transform = "linear", median = 1.0, sd = 0.3 }}
{}{}
[estimator]
{estimator}
"#,
        record("one"),
        record("two")
    )
}

const RATE: &str = "-k*x - c*v - d*abs(v)*v";

/// Two recordings from different starts, by steps so short that their error is far below the noise.
fn recordings() -> [(&'static str, String); 2] {
    let times = grid(80, 0.1);
    [("one.csv", 1.2, 5), ("two.csv", 0.7, 6)].map(|(name, start, seed)| {
        let (mut x, mut v, mut z) = (start, 0.0_f64, vec![start]);
        for _ in 1..times.len() {
            for _ in 0..10_000 {
                let h = 1e-5;
                v += h * (-4.0 * x - 0.15 * v - 0.2 * v.abs() * v);
                x += h * v;
            }
            z.push(x);
        }
        z.iter_mut().zip(normals(80, seed)).for_each(|(z, e)| *z += 0.02 * e);
        (name, csv("time,y", &[&times, &z]))
    })
}

fn fitted(estimator: &str) -> Done {
    run_once(&study(estimator, RATE), &recordings())
}

#[test]
fn it_finds_the_estimate_and_the_interval_of_the_fit_by_sigma_points() {
    let (exact, by_points) = (fitted("kind = \"gauss-newton\""), fitted("kind = \"batch\"\nspread = 0.01"));
    let close = |a: f64, b: f64, width: f64| (a - b).abs() < 0.006 * width;
    for (a, b) in exact.summary.parameters.iter().zip(&by_points.summary.parameters) {
        let width = b.interval95[1] - b.interval95[0];
        // Each ends within a hundredth of a posterior sd of the mode: both within half of a hundredth of the interval.
        assert!(close(a.estimate, b.estimate, width), "{a:?} and {b:?}");
        assert!(close(a.interval95[0], b.interval95[0], width), "{a:?} and {b:?}");
        assert!(close(a.interval95[1], b.interval95[1], width), "{a:?} and {b:?}");
    }
    let (a, b) = (exact.summary.fit.log_likelihood, by_points.summary.fit.log_likelihood);
    assert!((a - b).abs() < 0.05, "{a} and {b}");
    // Of two dampings the data know the sum; nothing else is doubtful.
    assert!(
        exact.summary.warnings.len() == 1 && exact.warns("c and d are correlated"),
        "{:?}",
        exact.summary.warnings
    );
}

#[test]
fn a_fit_that_took_no_step_says_so_and_what_is_held_fixed_is_told_by_its_name() {
    for kind in ["gauss-newton", "batch"] {
        let done = fitted(&format!("kind = \"{kind}\"\nmax_iterations = 1"));
        assert!(
            done.warns(&format!("the {kind} fit took no step before its iteration limit")),
            "{:?}",
            done.summary.warnings
        );
        let done = fitted(&format!("kind = \"{kind}\"\nmax_iterations = 2"));
        assert!(
            done.warns(&format!("the {kind} fit stopped at its iteration limit")),
            "{:?}",
            done.summary.warnings
        );
    }
    let walks = study("kind = \"gauss-newton\"", RATE);
    let (before, after) = walks.split_once("[[parameters]]\nname = \"c\"\n").unwrap();
    let walks = format!("{before}[[parameters]]\nname = \"c\"\nprocess = {{ walk = 0.1 }}\n{after}");
    let done = run_once(&walks, &recordings());
    assert!(done.warns("the gauss-newton fit holds c at one value"), "{:?}", done.summary.warnings);
}

#[test]
fn an_iteration_makes_one_run_of_each_record() {
    let done = fitted("kind = \"gauss-newton\"");
    let iterations = done.table("analyses", "step").len();
    let of_fit = done.table("jobs", "pass").iter().filter(|row| row[0] == "1").count();
    assert_eq!(of_fit, 2 * iterations);
}

#[test]
fn slopes_that_are_infinite_where_the_outputs_are_not_show_before_the_fit() {
    // The root of 1 - x moves infinitely fast with x where that is one, as at the start.
    let case = Case::new(&study("kind = \"gauss-newton\"", "-k*x - c*v - d*sqrt(1 - x)"), &recordings());
    let error = dry_run(&mut case.study(), &GAUSS_NEWTON, Depth::First).unwrap_err().to_string();
    assert!(error.contains("with its slopes"), "{error}");
    assert!(dry_run(&mut case.study(), &BATCH, Depth::First).is_ok());
}

#[test]
fn where_there_are_no_derivatives_the_study_is_refused() {
    let refused = |estimator: &str, rate: &str| {
        Case::new(&study(estimator, rate), &recordings()).refusal().expect("a refusal")
    };
    let exact = "kind = \"gauss-newton\"";
    let said = refused(exact, "-k*x - c*v - d*sign(v)");
    assert!(said.contains("rate of `v` jumps") && said.contains("use kind = \"batch\""), "{said}");
    let said = refused(&format!("{exact}\nspread = 0.1"), RATE);
    assert!(said.contains("`spread` belongs to kind = \"batch\""), "{said}");
    let said = refused(&format!("{exact}\npasses = 2"), RATE);
    assert!(said.contains("`passes` belongs to kind = \"roukf\""), "{said}");
    for key in ["tolerance = 0.1", "max_iterations = 9"] {
        let said = refused(key, RATE);
        assert!(said.contains("belongs to kind = \"batch\" or \"gauss-newton\""), "{said}");
    }
}
