//! `starlings infer` of rates that lack a term: the term is named alone, and nothing where none is missing.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::fs;

use common::{output, refused, starlings};
use infer_kit::{STUDY, folder, infer, recording};

/// The study with another rate of `x` and monomials up to the second degree as candidates.
fn lacking(rate: &str, parameters: &str) -> String {
    let candidates = "\n[infer.candidates]\ndegree = 2\n";
    let later = "\n[[records]]\nname = \"later\"\nfile = \"later.csv\"\nuse = \"held-out\"\n\
                 channels = [ { column = \"x\", output = \"x\" }, { column = \"z\", output = \"z\" } ]\n";
    let study = STUDY.replace("-k*(x - level) + c*z", rate);
    let study = study.replace(r#"parameters = ["k", "c", "d"]"#, parameters);
    format!("{study}{candidates}{later}")
}

#[test]
fn a_term_that_the_rates_lack_is_named_alone_and_nothing_where_none_is() {
    let data = recording(6_000, usize::MAX);
    let lines: Vec<&str> = data.lines().collect();
    let (train, later) = (lines[..4_001].join("\n"), [&lines[..1], &lines[4_001..]].concat().join("\n"));
    let made = |study: &str| {
        let dir = folder(study, &train);
        fs::write(dir.path().join("later.csv"), &later).unwrap();
        let found = infer(dir.path(), "one", "1");
        assert_eq!(found, infer(dir.path(), "two", "2"), "the same whoever makes the sums");
        let page = fs::read_to_string(dir.path().join("one/report.html")).unwrap();
        assert!(page.contains("Terms that the drift may lack"));
        found
    };
    // Without the coupling c z in the first rate; the second has it.
    let found = made(&lacking("-k*x", r#"parameters = ["k", "c", "d"]"#));
    let missing = &found["missing"];
    let names: Vec<&str> =
        missing["named"].as_array().unwrap().iter().map(|named| named["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["x:z"], "{missing}");
    let verdict = found["verdict"].as_str().unwrap();
    assert!(verdict.contains("the drift lacks x:z"), "{verdict}");
    let [lo, hi] = [0, 1].map(|end| missing["named"][0]["interval90"][end].as_f64().unwrap());
    // Euler's path: rates are wrong by one in a hundred or so at the mid-point.
    assert!(lo - 0.5 < 3.0 && 3.0 < hi + 0.5, "{lo} to {hi}");
    // Half of h (3 z)² / D per step, where z has a variance of a tenth of a unit, is some nats in a hundred steps.
    assert!(missing["held_out"]["gain"].as_f64().unwrap() > 5.0, "{missing}");
    assert_eq!(missing["held_out"]["n_step"], 2000);
    // With it the others are those of the whole model.
    let k = missing["coefficients"].as_array().unwrap().iter().find(|c| c["name"] == "k").unwrap();
    assert!((k["estimate"].as_f64().unwrap() - 2.0).abs() < 4.0 * k["sd"].as_f64().unwrap() + 0.1, "{k}");
    let found = made(&lacking("-k*x + c*z", r#"parameters = ["k", "c", "d"]"#));
    assert_eq!(found["missing"]["named"].as_array().unwrap().len(), 0, "{}", found["missing"]);
    assert!(found["verdict"].as_str().unwrap().contains("no term is missing"), "{}", found["verdict"]);
}

/// Runs `starlings explain` of a study in a folder.
fn explain(dir: &std::path::Path, out: &str) -> serde_json::Value {
    let arguments = ["explain", "study.toml", "--out", out, "--workers", "1", "--json"];
    let (code, stdout, stderr) = output(starlings().current_dir(dir).args(arguments));
    assert_eq!(code, 0, "{stderr}");
    let written: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(dir.join(out).join("explain.json")).unwrap()).unwrap();
    let shown: serde_json::Value =
        serde_json::from_str(&stdout).expect("--json prints JSON and nothing else");
    assert_eq!(shown, written);
    written
}

#[test]
fn explain_names_what_a_drift_lacks_and_writes_a_study_that_lacks_nothing() {
    let data = recording(6_000, usize::MAX);
    let candidates = "\n[infer.candidates]\ndegree = 2\n";
    let of_functions = STUDY.replace(r#"parameters = ["k", "c", "d"]"#, r#"functions = ["x"]"#);
    // Without the coupling in the first rate; with functions in both.
    let cases = [
        (STUDY.replace("-k*(x - level) + c*z", "-k*x"), "x:z", "added1", 3.0),
        (STUDY.replace("\"-k*(x - level) + c*z\"", "{ loss = \"-k*x\" }"), "x:z", "added1", 3.0),
        (of_functions, "x:z", "x:z", 3.0),
    ];
    for (study, term, coefficient, truth) in cases {
        let dir = folder(&format!("{study}{candidates}"), &data);
        let found = explain(dir.path(), "out");
        assert_eq!(found["verdict"], "named", "{found}");
        let effect = found["effects"].as_array().unwrap().iter().find(|e| e["name"] == term).unwrap();
        assert_eq!(effect["adds"][0], serde_json::json!({ "to": "x", "term": "z" }));
        let parameter = &effect["parameters"][0];
        assert_eq!(parameter["name"], coefficient);
        let (estimate, sd) = (parameter["estimate"].as_f64().unwrap(), parameter["sd"].as_f64().unwrap());
        // Euler's path: rates are wrong by one in a hundred or so at the mid-point.
        assert!((estimate - truth).abs() < 4.0 * sd + 0.1, "{estimate} ± {sd}");
        assert!(found["remaining"]["by_chance"].as_f64().unwrap() > 0.01, "{found}");
        // Its files are named from its own folder.
        let explained = ["infer", "out/explained.toml", "--out", "again", "--workers", "1", "--json"];
        let (code, stdout, stderr) = output(starlings().current_dir(dir.path()).args(explained));
        assert_eq!(code, 0, "{stderr}");
        let again: serde_json::Value = serde_json::from_str(&stdout).unwrap();
        assert_eq!(again["missing"]["named"], serde_json::json!([]), "{}", again["missing"]);
        let with =
            again["coefficients"].as_array().unwrap().iter().find(|c| c["name"] == coefficient).unwrap();
        assert!((with["estimate"].as_f64().unwrap() - estimate).abs() < 0.1 * sd + 1e-6, "{with}");
    }
}

#[test]
fn explain_of_a_drift_that_lacks_nothing_says_so_and_options_of_the_other_search_are_refused() {
    let data = recording(6_000, usize::MAX);
    let dir = folder(&format!("{STUDY}\n[infer.candidates]\ndegree = 2\n"), &data);
    let found = explain(dir.path(), "out");
    assert_eq!((&found["verdict"], &found["effects"]), (&"no-gap".into(), &serde_json::json!([])), "{found}");
    assert!(!dir.path().join("out/explained.toml").exists());
    let command = |arguments: &[&str]| {
        let mut command = starlings();
        command.current_dir(dir.path()).args(["explain", "study.toml", "--out", "other"]).args(arguments);
        command
    };
    refused(
        &mut command(&["--null", "3"]),
        &["--null belongs to the search of effects", "leave the option out"],
    );
    refused(&mut command(&["--resume"]), &["--resume belongs to the search of effects"]);
    fs::write(dir.path().join("study.toml"), STUDY).unwrap();
    refused(&mut command(&[]), &["none is listed", "[infer.candidates]", "degree = 2"]);
    assert!(!dir.path().join("other").exists(), "no folder of what was refused");
}
