//! `starlings identify`: what a design can determine, said before anything is estimated.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod identify_kit;

use std::fmt::Write as _;
use std::path::Path;

use common::{repository, run};
use identify_kit::{Case, numbers, parameter, warns};
use serde_json::Value;

/// Distal pressure of the periodic state of the RCR example, dyn/cm^2.
const PERIODIC: f64 = 114_922.16;

/// The RCR example with its priors at the truth; the initial pressure is fixed, or has the prior given.
fn windkessel(initial: &str) -> Case {
    let constants = if initial.is_empty() {
        format!("constants = {{ \"initial:p\" = {PERIODIC} }}")
    } else {
        String::new()
    };
    let initial = if initial.is_empty() {
        String::new()
    } else {
        format!(
            "[[parameters]]\nname = \"initial:p\"\nprior = {{ transform = \"linear\", median = {PERIODIC}, {initial} }}\n"
        )
    };
    let example = |file: &str| repository("examples/rcr").join(file).display().to_string();
    Case::new(&format!(
        r#"
[study]
name = "windkessel"
[model]
kind = "windkessel-3"
{constants}
[[parameters]]
name = "Zc"
prior = {{ transform = "log", median = 150.0, sd = 0.7 }}
[[parameters]]
name = "R"
prior = {{ transform = "log", median = 1850.0, sd = 0.7 }}
[[parameters]]
name = "C"
prior = {{ transform = "log", median = 1e-3, sd = 0.7 }}
{initial}
[[records]]
name = "ten-beats"
file = "{}"
inputs = {{ flow = "{}:flow" }}
channels = [{{ column = "pressure", output = "pressure", noise = 2666.44 }}]
"#,
        example("pressure.csv"),
        example("flow.csv"),
    ))
}

#[test]
fn generalised_sensitivities_of_the_windkessel_at_its_truth_are_those_of_the_table() {
    let found = windkessel("").json(&[]);
    let time = numbers(&found["gsf"]["time"]);
    let table = [
        ("Zc", [0.0294, 0.1163, 0.1163, 0.3279, 1.0]),
        ("R", [-0.0004, -0.0029, 0.0055, 0.0928, 1.0]),
        ("C", [-0.0001, 0.0954, 0.1910, 0.4137, 1.0]),
    ];
    for (name, expected) in table {
        let curve = numbers(&found["gsf"][name]);
        assert_eq!(curve.len(), time.len());
        for (t, expected) in [0.1, 0.3, 0.8, 2.4, 8.0].into_iter().zip(expected) {
            let k = time.iter().position(|at| (at - t).abs() < 1e-9).unwrap();
            // The table has four decimals; the model holds the flow linear in time where the table's holds it constant.
            assert!((curve[k] - expected).abs() < 1e-3, "{name} at {t}: {} {expected}", curve[k]);
        }
    }
    assert_eq!(found["warnings"].as_array().unwrap().len(), 0, "{}", found["warnings"]);
    assert_eq!(found["runs"], 7, "a centre and a pair for each of three parameters");
    assert!(found["collinearity"]["index"].as_f64().unwrap() > 1.0);
    assert!(found["advice"].as_str().unwrap().contains("reasonable"), "{}", found["advice"]);
}

#[test]
fn the_expected_sd_is_that_of_the_batch_fit_with_its_prior() {
    let found = windkessel("sd = 39996.6").json(&[]);
    // Posterior sd of the logarithms, (J^T W^-1 J + P0^-1)^-1 at the truth, printed with six or seven digits.
    for (name, expected) in [("Zc", 0.005_836_28), ("R", 0.001_044_43), ("C", 0.008_004_8)] {
        let sd = parameter(&found, name)["expected_sd"].as_f64().unwrap();
        // The flow between its samples: linear here, piecewise constant there.
        assert!((sd / expected - 1.0).abs() < 1e-3, "{name}: {sd} {expected}");
    }
    for p in found["parameters"].as_array().unwrap() {
        let (expected, prior) = (p["expected_sd"].as_f64().unwrap(), p["prior_sd"].as_f64().unwrap());
        assert!((p["informed"].as_f64().unwrap() - (1.0 - expected / prior)).abs() < 1e-12);
        assert!(p["standard_error"].as_f64().unwrap() >= expected, "the prior can only help");
    }
}

/// x' = -(a + b) x with observed x, and a parameter of nothing.
fn decay(extra: &str, parameters: &[(&str, &str)]) -> Case {
    let mut study = format!(
        r#"
[study]
name = "decay"
[model]
kind = "equations"
outputs = [{{ name = "level", value = "x" }}]
{extra}
[[model.states]]
name = "x"
initial = 1.0
rate = "-(a + b)*x + 0*idle"
[[records]]
name = "one"
file = "one.csv"
channels = [{{ column = "level", output = "level", noise = 0.01 }}]
"#
    );
    for (name, prior) in parameters {
        write!(study, "[[parameters]]\nname = \"{name}\"\nprior = {{ {prior} }}\n").unwrap();
    }
    let rows = (0..40).map(|k| (0.1 * f64::from(k), (-0.1 * f64::from(k)).exp()));
    let text = rows.fold("time,level\n".to_owned(), |text, (t, x)| format!("{text}{t},{x}\n"));
    Case::new(&study).with("one.csv", &text)
}

const HALF: &str = "transform = \"log2\", median = 0.5, sd = 0.5";

#[test]
fn parameters_that_enter_only_as_a_sum_are_named_as_one_combination() {
    let case = decay("constants = { idle = 1.0 }", &[("a", HALF), ("b", HALF)]);
    let found = case.json(&[]);
    assert!((found["correlation"][0][1].as_f64().unwrap() + 1.0).abs() < 1e-9, "{}", found["correlation"]);
    for name in ["a", "b"] {
        assert!(parameter(&found, name)["standard_error"].is_null());
        // Half the prior variance lies along the sum, which the data know.
        let left = parameter(&found, name)["expected_sd"].as_f64().unwrap() / 0.5;
        assert!((left - 0.5_f64.sqrt()).abs() < 1e-3, "{left}");
        assert!(found["gsf"][name].as_array().unwrap().iter().all(Value::is_null));
    }
    assert!(found["collinearity"]["index"].is_null());
    let weakest = &found["directions"][0];
    let words = weakest["combination"].as_str().unwrap();
    assert!(words == "a − b" || words == "b − a", "{words}");
    assert!(warns(&found, &["correlated (-1.000)"]), "{}", found["warnings"]);
    assert!(warns(&found, &["combination", words]), "{}", found["warnings"]);
    assert!(found["advice"].as_str().unwrap().contains("fix one"), "{}", found["advice"]);

    // The estimation says the same afterwards.
    let summary = run(&case.path("study.toml"), &case.path("run"), 1);
    assert!(warns(&summary, &["combination"]), "{}", summary["warnings"]);
    assert!(warns(&summary, &["a and b are correlated"]), "{}", summary["warnings"]);
    let (code, stdout, _) = case.identify(&[]);
    assert_eq!(code, 0);
    assert!(stdout.contains(words) && stdout.contains("no information"), "{stdout}");
    assert!(!stdout.contains("NaN") && !stdout.contains("inf "), "{stdout}");
}

#[test]
fn a_parameter_that_changes_nothing_is_said_in_words_and_null_in_json() {
    let case = decay("constants = { b = 0.5 }", &[("a", HALF), ("idle", HALF)]);
    let found = case.json(&[]);
    let idle = parameter(&found, "idle");
    assert!(idle["standard_error"].is_null());
    assert!(idle["informed"].as_f64().unwrap().abs() < 1e-12);
    assert!(idle["sensitivity_norm"].as_f64().unwrap() < 1e-9);
    assert!(found["correlation"][0][1].is_null() && found["correlation"][1][0].is_null());
    assert!(warns(&found, &["idle changes no observed prediction"]), "{}", found["warnings"]);
    assert!(!warns(&found, &["combination"]), "{}", found["warnings"]);
    let curve = numbers(&found["gsf"]["a"]);
    assert!((curve.last().unwrap() - 1.0).abs() < 1e-9, "the others have their curves");
    assert!(found["advice"].as_str().unwrap().contains("Fix idle"), "{}", found["advice"]);
}

#[test]
fn the_page_and_the_table_hold_what_was_computed_and_no_invalid_number() {
    let case = decay("constants = { idle = 1.0 }", &[("a", HALF), ("b", HALF)]);
    let (html, csv) = (case.path("page.html"), case.path("table.csv"));
    let (code, stdout, stderr) =
        case.identify(&["--html", html.to_str().unwrap(), "--csv", csv.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("what the data would leave"), "{stdout}");
    let page = std::fs::read_to_string(&html).unwrap();
    // Without the page's script and the numbers of its figures.
    let parts = page.split("<script").enumerate();
    let read = parts.map(|(k, part)| if k == 0 { part } else { part.split_once("</script>").unwrap().1 });
    let outside = read.collect::<String>().replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for forbidden in ["http://", "https://", "NaN", "inf\"", "None"] {
        assert!(!outside.contains(forbidden), "the page contains {forbidden}");
    }
    for section in
        ["warnings", "parameters", "directions", "correlation", "sensitivity", "gsf", "collinearity"]
    {
        assert!(page.contains(&format!("id=\"{section}\"")), "{section}");
    }
    assert!(page.contains("<svg") && page.contains("a: sensitivity"));
    let table = std::fs::read_to_string(&csv).unwrap();
    assert_eq!(
        table.lines().next().unwrap(),
        "record,time,output,noise,prediction,sensitivity:a,sensitivity:b,gsf:a,gsf:b"
    );
    assert_eq!(table.lines().count(), 1 + 40);
    let cells: Vec<&str> = table.lines().nth(11).unwrap().split(',').collect();
    // x = exp(-t) at a + b = 1: dx/d log2 a = -t x a ln 2, over the noise of 0.01.
    let expected = -(-1.0_f64).exp() * 0.5 * std::f64::consts::LN_2 / 0.01;
    assert!((cells[5].parse::<f64>().unwrap() / expected - 1.0).abs() < 1e-5, "{cells:?} {expected}");
    assert_eq!((cells[7], cells[8]), ("", ""), "no such function, no number");
}

#[test]
fn a_finished_run_is_a_point_of_the_analysis_and_anything_else_is_refused() {
    let case = decay(
        "constants = { b = 0.5, idle = 1.0 }",
        &[("a", "transform = \"log2\", median = 1.0, sd = 1.0")],
    );
    let summary = run(&case.path("study.toml"), &case.path("run"), 1);
    let run_folder = case.path("run");
    let found = case.json(&["--at", run_folder.to_str().unwrap()]);
    let (value, estimate) = (&found["parameters"][0]["value"], &summary["parameters"][0]["estimate"]);
    assert!((value.as_f64().unwrap() / estimate.as_f64().unwrap() - 1.0).abs() < 1e-12);
    assert!((estimate.as_f64().unwrap() - 0.5).abs() < 1e-2, "the prior median was 1");
    let sd = summary["parameters"][0]["sd"].as_f64().unwrap();
    let foretold = found["parameters"][0]["expected_sd_physical"].as_f64().unwrap();
    // The same Gauss-Newton covariance, by a filter whose points are not in the limit of small spread.
    assert!((foretold / sd - 1.0).abs() < 0.02, "{foretold} {sd}");

    let other = decay("constants = { a = 0.5, idle = 1.0 }", &[("b", HALF)]);
    let (code, _, stderr) = other.identify(&["--at", run_folder.to_str().unwrap()]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("did not estimate `b`"), "{stderr}");
    let (code, _, stderr) = case.identify(&["--at", case.path("nowhere").to_str().unwrap()]);
    assert_eq!(code, 2, "{stderr}");
}

#[test]
fn a_model_that_fails_next_to_the_point_is_an_error_that_names_the_parameter() {
    let case =
        decay("", &[("a", HALF), ("b", HALF), ("idle", "transform = \"linear\", median = 0.0, sd = 1.0")]);
    let study = std::fs::read_to_string(case.path("study.toml")).unwrap().replace("0*idle", "sqrt(idle)");
    let case = case.with("study.toml", &study);
    let (code, stdout, stderr) = case.identify(&["--json"]);
    assert_eq!(code, 1, "{stderr}");
    let answer: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert!(answer["error"].as_str().is_some_and(|error| error.contains("idle moved downwards")), "{stdout}");
    assert!(stderr.contains("idle moved downwards") && stderr.contains("record `one`"), "{stderr}");
}

#[test]
fn wrong_input_is_refused_before_anything_runs() {
    let case = decay("constants = { a = 0.5, b = 0.5, idle = 1.0 }", &[]);
    let (code, _, stderr) = case.identify(&[]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("no parameter to estimate"), "{stderr}");
    let case = decay("constants = { b = 0.5, idle = 1.0 }", &[("a", HALF)]);
    let refused = |extra: &[&str], words: &str| {
        let (code, _, stderr) = case.identify(extra);
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains(words), "{stderr}");
    };
    refused(&["--workers", "0"], "--workers must be at least 1");
    let study = case.path("study.toml");
    let before = std::fs::read(&study).unwrap();
    refused(&["--csv", study.to_str().unwrap()], "would be overwritten");
    assert_eq!(std::fs::read(Path::new(&study)).unwrap(), before);
}
