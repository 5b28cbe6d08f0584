//! `starlings infer` of rates that lack a term: the term is named alone, and nothing where none is missing.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;
mod infer_kit;

use std::fs;

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
