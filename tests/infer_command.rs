//! `starlings infer`: the same bytes whoever makes the sums, priors, reduced models, the tables of the results.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::fs;

use common::{output, starlings};
use infer_kit::{STUDY, folder, infer, recording};

#[test]
fn one_two_and_three_workers_give_the_same_bytes() {
    let dir = folder(STUDY, &recording(5000, usize::MAX));
    let found = infer(dir.path(), "one", "1");
    for (out, workers) in [("two", "2"), ("three", "3")] {
        infer(dir.path(), out, workers);
        for file in ["infer.json", "coefficients.csv", "report.html", "study.toml"] {
            let read = |folder: &str| fs::read(dir.path().join(folder).join(file)).unwrap();
            assert_eq!(read("one"), read(out), "{file}");
        }
    }
    for (name, truth) in [("k", 2.0), ("c", 3.0), ("d", 1.0)] {
        let entry = found["coefficients"].as_array().unwrap().iter().find(|c| c["name"] == name).unwrap();
        let (estimate, sd) = (entry["estimate"].as_f64().unwrap(), entry["sd"].as_f64().unwrap());
        // Four sd, and the error of the mid-point for a path of Euler's method: 1 % of the rates of decay.
        assert!((estimate - truth).abs() < 4.0 * sd + 0.1, "{name}: {estimate} ± {sd}");
    }
    assert_eq!(found["convergence"].as_array().unwrap().len(), 6, "after 1, 2, 4, 8, 16 and all 17 blocks");
    let (code, _, stderr) = output(starlings().current_dir(dir.path()).args(["report", "two"]));
    assert_eq!(code, 0, "{stderr}");
}

#[test]
fn a_prior_holds_where_the_data_say_little() {
    let prior =
        "\n[[parameters]]\nname = \"k\"\nprior = { transform = \"linear\", median = 2.5, sd = 1e-4 }\n";
    let dir = folder(&format!("{STUDY}{prior}"), &recording(2000, usize::MAX));
    let found = infer(dir.path(), "out", "1");
    let k = &found["coefficients"][0];
    assert!((k["estimate"].as_f64().unwrap() - 2.5).abs() < 3e-4, "{k}");
    assert_eq!(k["prior"][1], 1e-4);
}

#[test]
fn a_name_over_two_lines_is_one_line_of_the_table() {
    let study = STUDY.replace(r#"parameters = ["k", "c", "d"]"#, r#"functions = ["x", "x *\n  z"]"#);
    let dir = folder(&study, &recording(1_000, usize::MAX));
    infer(dir.path(), "out", "1");
    let table = fs::read_to_string(dir.path().join("out/coefficients.csv")).unwrap();
    assert!(table.lines().all(|line| line.split(',').count() >= 7), "{table}");
    assert!(table.contains("\nx:x * z,"), "{table}");
}

#[test]
fn a_reduced_model_is_fitted_to_extrapolated_coefficients() {
    let reduced = "\n[infer.reduced]\nstart = { a = 1.0, b = 1.0, e = 1.0 }\ncoefficients = { k = \"a\", c = \"b\", d = \"e\" }\n";
    let study = STUDY.replace("block = 300", "richardson = true") + reduced;
    let dir = folder(&study, &recording(2_000, usize::MAX));
    let found = infer(dir.path(), "out", "1");
    for k in 0..3 {
        let (of, unknown) = (&found["coefficients"][k], &found["reduced"]["unknowns"][k]);
        let [moved, before, same] =
            [&of["estimate"], &of["at_step"], &unknown["estimate"]].map(|v| v.as_f64().unwrap());
        // As many unknowns as coefficients: the reduced model is the coefficients, as far as its search converges.
        assert!((moved - same).abs() < 1e-6 && (before - same).abs() > 1e-4, "{of} {unknown}");
    }
}

#[test]
fn a_step_that_cannot_be_fitted_leaves_the_estimate_where_it_is() {
    let study = STUDY.replace("block = 300", "richardson = true");
    let dir = folder(&study, &recording(12, usize::MAX));
    let found = infer(dir.path(), "out", "1");
    let warning = found["warnings"][0].as_str().unwrap();
    assert!(warning.contains("`richardson`") && warning.contains("at steps of 2h"), "{warning}");
    assert!(found["richardson"].is_null() && found["coefficients"][0]["estimate"].is_f64(), "{found}");
}
