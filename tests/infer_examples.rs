//! Every example of an inference as a user would make it: its data are simulated, the study is inferred, and both the promises of its
//! `expected.toml` and the table in its README are compared with what comes out.
//!
//! `STARLINGS_WRITE_PAGES=1 cargo test --test infer_examples` writes the tables again.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod example_kit;

use std::fmt::Write as _;
use std::path::Path;

use common::{output, repository, starlings};
use example_kit::of_inference;
use serde::Deserialize;
use serde_json::Value;

/// What an example promises.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    /// Arguments of `starlings simulate` that make the data.
    simulate: Vec<String>,
    /// What the verdict says.
    verdict: String,
    /// Range of χ² of the reduced model.
    chi_squared: Option<[f64; 2]>,
    #[serde(default)]
    coefficients: Vec<Promise>,
    #[serde(default)]
    unknowns: Vec<Promise>,
    #[serde(default)]
    noise: Vec<Noise>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Promise {
    name: String,
    truth: f64,
    chapter: Option<String>,
    within_sd: f64,
    /// Beyond the standard deviations, for the error of the step.
    #[serde(default)]
    within: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Noise {
    equation: String,
    /// Of which the noise has the covariance with this one; itself without it.
    with: Option<String>,
    truth: f64,
    chapter: Option<String>,
    within_sd: f64,
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// A number to the digits that its standard deviation justifies.
fn rounded(value: f64, sd: f64) -> String {
    let decimals = (1.0 - sd.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$}")
}

/// Compares a list of the result with its promises, and makes a line of the table of each.
fn compare(found: &Value, promises: &[Promise]) -> String {
    let mut table = String::new();
    let columns = promises.iter().any(|p| p.chapter.is_some());
    table.push_str(if columns {
        "| | true | chapter | found | 90 % interval |\n|---|---|---|---|---|\n"
    } else {
        "| | true | found | 90 % interval |\n|---|---|---|---|\n"
    });
    for p in promises {
        let entry = found.as_array().unwrap().iter().find(|c| c["name"] == p.name.as_str());
        let entry = entry.unwrap_or_else(|| panic!("no `{}` in {found}", p.name));
        let (estimate, sd) = (number(&entry["estimate"]), number(&entry["sd"]));
        let off = (estimate - p.truth).abs();
        assert!(off <= p.within_sd * sd + p.within, "{}: {estimate} ± {sd} for {}", p.name, p.truth);
        let ends = [0, 1].map(|k| rounded(number(&entry["interval90"][k]), sd));
        let chapter =
            if columns { format!(" {} |", p.chapter.as_deref().unwrap_or("")) } else { String::new() };
        let zero = if entry["may_be_zero"] == true { ", may be zero" } else { "" };
        writeln!(
            table,
            "| `{}` | {} |{chapter} {} ± {} | {} to {}{zero} |",
            p.name,
            (p.truth * 1e4).round() / 1e4,
            rounded(estimate, sd),
            rounded(sd, sd),
            ends[0],
            ends[1],
        )
        .unwrap();
    }
    table
}

/// Compares the noise with its promises; lines of the table where it has a column for the chapter's values.
fn compare_noise(found: &Value, promises: &[Noise], columns: bool) -> String {
    let mut table = String::new();
    let at = |name: &str| found["equations"].as_array().unwrap().iter().position(|e| *e == name).unwrap();
    for p in promises {
        let (i, j) = (at(&p.equation), at(p.with.as_ref().unwrap_or(&p.equation)));
        let entry = |key: &str| number(&found["diffusion"][key][i][j]);
        let (value, sd) = (entry("matrix"), entry("sd"));
        let with = p.with.as_ref().map_or_else(String::new, |with| format!(", {with}"));
        let name = format!("D of {}{with}", p.equation);
        assert!((value - p.truth).abs() <= p.within_sd * sd, "{name}: {value} ± {sd} for {}", p.truth);
        if columns {
            let chapter = p.chapter.as_deref().unwrap_or("");
            let (value, sd) = (scaled(value, sd), scaled(sd, sd));
            writeln!(table, "| {name} | {} | {chapter} | {value} ± {sd} | |", p.truth).unwrap();
        }
    }
    table
}

/// A number that may be far below one, to two digits of its standard deviation.
fn scaled(value: f64, sd: f64) -> String {
    if sd > 1e-4 {
        return rounded(value, sd);
    }
    let digits = (value.abs().log10().floor() - sd.log10().floor()).max(0.0) as usize + 1;
    format!("{value:.digits$e}")
}

/// The README holds this table between its marks, or gets it where that is asked for.
fn table_is_fresh(readme: &Path, table: &str) {
    let text = std::fs::read_to_string(readme).unwrap();
    let (begin, end) = ("<!-- table -->\n", "<!-- end of table -->");
    let from = text.find(begin).unwrap() + begin.len();
    let to = text.find(end).unwrap();
    if std::env::var_os("STARLINGS_WRITE_PAGES").is_some() {
        std::fs::write(readme, format!("{}{table}{}", &text[..from], &text[to..])).unwrap();
    } else {
        assert_eq!(
            &text[from..to],
            table,
            "{}: write it again as the head of this test says",
            readme.display()
        );
    }
}

fn example(name: &str) {
    let source = repository("examples").join(name);
    let expected: Expected =
        toml::from_str(&std::fs::read_to_string(source.join("expected.toml")).unwrap()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    for file in ["study.toml", "truth.toml", "start.csv"] {
        std::fs::copy(source.join(file), dir.path().join(file)).unwrap();
    }
    let (code, _, stderr) =
        output(starlings().current_dir(dir.path()).arg("simulate").args(&expected.simulate));
    assert_eq!(code, 0, "{stderr}");
    let infer = ["infer", "study.toml", "--out", "out", "--workers", "2", "--json"];
    let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(infer));
    assert_eq!(code, 0, "{stderr}");
    let found: Value = serde_json::from_str(&stdout).expect("--json prints JSON and nothing else");
    let verdict = found["verdict"].as_str().unwrap();
    assert!(verdict.contains(&expected.verdict), "{verdict}");
    let mut table = String::new();
    if !expected.coefficients.is_empty() {
        table.push_str(&compare(&found["coefficients"], &expected.coefficients));
    }
    if !expected.unknowns.is_empty() {
        if !table.is_empty() {
            table.push('\n');
        }
        table.push_str(&compare(&found["reduced"]["unknowns"], &expected.unknowns));
    }
    let columns = table.contains("chapter");
    table.push_str(&compare_noise(&found, &expected.noise, columns));
    if let Some([lo, hi]) = expected.chi_squared {
        let chi = number(&found["reduced"]["chi_squared"]);
        assert!((lo..=hi).contains(&chi), "χ² {chi} outside [{lo}, {hi}]");
    }
    let report = std::fs::read_to_string(dir.path().join("out/report.html")).unwrap();
    assert!(report.contains("<svg"), "the report has its plots inside");
    table_is_fresh(&source.join("README.md"), &table);
}

/// The study of the example `lorenz` with a term left out of its rates, or as it is, and every quadratic monomial as a candidate.
fn lacking(term: &str, coefficient: &str) -> String {
    let study = std::fs::read_to_string(repository("examples/lorenz/study.toml")).unwrap();
    let listed = format!("\"{coefficient}\", ");
    assert!(study.contains(term) && (coefficient.is_empty() || study.contains(&listed)), "{term}");
    let study = if term.is_empty() { study } else { study.replace(term, "").replace(&listed, "") };
    let study = study.replace("\"isotropic\"", "\"full\"");
    study.replace("[[records]]", "[infer.candidates]\ndegree = 2\n\n[[records]]")
}

/// The path of `lorenz-27`, whose noise is that of the chapter's reconstruction.
#[test]
fn a_hidden_term_of_the_lorenz_system_is_named_alone_and_none_of_the_whole_system() {
    let dir = tempfile::tempdir().unwrap();
    for file in ["truth.toml", "start.csv"] {
        std::fs::copy(repository("examples/lorenz-27").join(file), dir.path().join(file)).unwrap();
    }
    let simulate = ["simulate", "truth.toml", "--until", "100", "--step", "0.005", "-o", "data.csv"];
    let (code, _, stderr) = output(starlings().current_dir(dir.path()).args(simulate));
    assert_eq!(code, 0, "{stderr}");
    let cases = [
        (" + b213*x1*x3", "b213", "x2:x1*x3", -1.0),
        (" + a22*x2", "a22", "x2:x2", -1.0),
        ("b312*x1*x2 + ", "b312", "x3:x1*x2", 1.0),
        ("", "", "", 0.0),
    ];
    for (term, coefficient, expected, truth) in cases {
        std::fs::write(dir.path().join("study.toml"), lacking(term, coefficient)).unwrap();
        let out = format!("out-{coefficient}");
        let infer = ["infer", "study.toml", "--out", &out, "--workers", "2", "--json"];
        let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(infer));
        assert_eq!(code, 0, "{stderr}");
        let found: Value = serde_json::from_str(&stdout).expect("--json prints JSON and nothing else");
        let named = found["missing"]["named"].as_array().unwrap();
        let names: Vec<&str> = named.iter().map(|named| named["name"].as_str().unwrap()).collect();
        if expected.is_empty() {
            assert!(names.is_empty(), "{names:?}");
            continue;
        }
        assert_eq!(names, [expected], "without {coefficient}");
        let (estimate, sd) = (number(&named[0]["estimate"]), number(&named[0]["sd"]));
        // Four posterior sd, and the step's error as the example states it.
        assert!((estimate - truth).abs() < 4.0 * sd + 0.03, "{expected}: {estimate} ± {sd}");
        assert_eq!(named[0]["ties"], serde_json::json!([]), "{expected}");
    }
}

macro_rules! examples {
    ($($test:ident => $name:literal),+ $(,)?) => {
        $(#[test] fn $test() { example($name); })+

        #[test]
        fn every_example_of_an_inference_is_tested() {
            let listed: std::collections::BTreeSet<String> = [$($name),+].map(str::to_owned).into();
            assert_eq!(listed, of_inference());
        }
    };
}

examples! {
    lorenz => "lorenz",
    lorenz_27 => "lorenz-27",
    three_tanks => "three-tanks",
    mixed_oscillators => "mixed-oscillators",
    motor_ignition => "motor-ignition",
}
