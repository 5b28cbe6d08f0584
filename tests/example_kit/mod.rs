//! Runs the studies of an example as a user would, and compares each with what it promises.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test
#![allow(dead_code)] // every test file uses its own part

use std::collections::BTreeSet;
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use crate::common::{repository, run};

/// What an example promises.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    #[serde(default)]
    parameters: Vec<Parameter>,
    #[serde(default)]
    fit: Fit,
    #[serde(default)]
    predictions: Vec<Prediction>,
    #[serde(default)]
    warnings: Warnings,
}

/// The truth of a quantity over a record, which its intervals are to hold when they are so many times as wide.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Prediction {
    output: String,
    lowest: f64,
    highest: f64,
    within: f64,
    /// Length of an interval over its value at most.
    narrower_than: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Parameter {
    name: String,
    estimate: f64,
    within_sd: Option<f64>,
    within_relative: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Fit {
    #[serde(default)]
    channels: Vec<Channel>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Channel {
    name: String,
    train_rmse: Option<[f64; 2]>,
    held_out_rmse: Option<[f64; 2]>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Warnings {
    #[serde(default)]
    contains: Vec<String>,
    #[serde(default)]
    lacks: Vec<String>,
}

fn named<'a>(list: &'a Value, name: &str) -> &'a Value {
    list.as_array()
        .and_then(|all| all.iter().find(|entry| entry["name"] == name))
        .unwrap_or_else(|| panic!("no `{name}` in {list}"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

fn compare(summary: &Value, expected: &Expected) {
    for p in &expected.parameters {
        let found = named(&summary["parameters"], &p.name);
        let (estimate, sd) = (number(&found["estimate"]), number(&found["sd"]));
        let off = (estimate - p.estimate).abs();
        if let Some(limit) = p.within_sd {
            assert!(off <= limit * sd, "{}: {estimate} is {:.2} sd from {}", p.name, off / sd, p.estimate);
        }
        if let Some(limit) = p.within_relative {
            assert!(off <= limit * p.estimate.abs(), "{}: {estimate} against {}", p.name, p.estimate);
        }
        assert!(p.within_sd.is_some() || p.within_relative.is_some(), "{} is compared with nothing", p.name);
    }
    for c in &expected.fit.channels {
        let found = named(&summary["fit"]["channels"], &c.name);
        for (key, range) in [("train_rmse", c.train_rmse), ("held_out_rmse", c.held_out_rmse)] {
            if let Some([lo, hi]) = range {
                let value = number(&found[key]);
                assert!((lo..=hi).contains(&value), "{} {key}: {value} outside [{lo}, {hi}]", c.name);
            }
        }
    }
    expected.predictions.iter().for_each(|p| compare_prediction(summary, p));
    let warnings = summary["warnings"].to_string();
    for text in &expected.warnings.contains {
        assert!(warnings.contains(text), "no warning about `{text}` in {warnings}");
    }
    for text in &expected.warnings.lacks {
        assert!(!warnings.contains(text), "an unexpected warning about `{text}` in {warnings}");
    }
}

fn compare_prediction(summary: &Value, expected: &Prediction) {
    let all = summary["predictions"].as_array().expect("predictions");
    let found = all.iter().find(|p| p["output"] == expected.output.as_str());
    let found = found.unwrap_or_else(|| panic!("no `{}` in {all:?}", expected.output));
    for (key, truth) in [("lowest", expected.lowest), ("highest", expected.highest)] {
        let [lo, hi] = [0, 1].map(|end| number(&found[key]["interval95"][end]));
        let estimate = number(&found[key]["estimate"]);
        let (off, half) = ((estimate - truth).abs(), 0.5 * (hi - lo));
        assert!(
            off <= expected.within * half,
            "{} {key}: {estimate} in {lo} to {hi}, {truth}",
            expected.output
        );
        let limit = expected.narrower_than * truth.abs();
        assert!(2.0 * half < limit, "{} {key}: {lo} to {hi} is wider than {limit}", expected.output);
    }
}

/// Runs every study of a folder that has expectations: `study.toml` against `expected.toml`, and `NAME.toml` against
/// `expected-NAME.toml`.
pub(crate) fn example_in(folder: &Path) {
    let mut compared = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let file = path.file_name().unwrap().to_string_lossy().into_owned();
        let Some(stem) = file.strip_prefix("expected").and_then(|f| f.strip_suffix(".toml")) else {
            continue;
        };
        let study =
            folder.join(stem.strip_prefix('-').map_or("study.toml".to_owned(), |s| format!("{s}.toml")));
        compare_study(&study, &path);
        compared += 1;
    }
    assert!(compared > 0, "{} promises nothing", folder.display());
}

fn compare_study(study: &Path, expected: &Path) {
    let expected: Expected = toml::from_str(&std::fs::read_to_string(expected).unwrap()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let summary = run(study, &out, 2);
    compare(&summary, &expected);
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("<svg"), "the report has its plots inside");
}

/// Names of the examples whose model runs in a program of its own.
pub(crate) fn of_solvers() -> BTreeSet<String> {
    with("kind = \"solver\"")
}

/// Names of the examples that are inferred.
pub(crate) fn of_inference() -> BTreeSet<String> {
    with("\n[infer]\n")
}

/// Names of the examples whose study has this text.
fn with(text: &str) -> BTreeSet<String> {
    let has = |name: &String| {
        let study = repository("examples").join(name).join("study.toml");
        std::fs::read_to_string(study).is_ok_and(|study| study.contains(text))
    };
    all().into_iter().filter(has).collect()
}

/// Names of all examples.
pub(crate) fn all() -> BTreeSet<String> {
    std::fs::read_dir(repository("examples"))
        .unwrap()
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.path().is_dir())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect()
}
