//! Bad input to `starlings explain`: one message with its place and its remedy, exit code 2, nothing left behind.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::fs;
use std::path::PathBuf;

use common::{output, starlings};

const DATA: &str =
    "time,position,speed\n0.0,0.1,0.0\n0.1,0.09,-0.1\n0.2,0.07,-0.2\n0.3,0.04,-0.2\n0.4,0.01,-0.2\n";

const STUDY: &str = r#"[study]
name = "spring"

[model]
kind = "equations"
constants = { c = 0.1 }
outputs = [ { name = "position", unit = "m", value = "x" }, { name = "speed", unit = "m/s", value = "v" } ]

[[model.states]]
name = "x"
unit = "m"
initial = 0.1
rate = "v"

[[model.states]]
name = "v"
unit = "m/s"
initial = 0.0
rate = "-k*x - c*v"

[[parameters]]
name = "k"
unit = "1/s^2"
prior = { transform = "log", median = 4.0, factor = 2.0 }

[[effects]]
name = "cubic"
adds = [ { to = "v", term = "-k3*x^3" } ]
parameters = [ { name = "k3", unit = "1/m^2/s^2", range = [0, 500] } ]

[[records]]
name = "one"
file = "data.csv"
channels = [
  { column = "position", output = "position", noise = 0.01 },
  { column = "speed", output = "speed", noise = 0.1 },
]
train = [0.0, 0.3]

[explain]
library = "study"

[estimator]
kind = "batch"

[fleet]
workers = 1
"#;

struct Case {
    dir: tempfile::TempDir,
    file: PathBuf,
}

/// The small study with one place replaced.
fn case(from: &str, to: &str) -> Case {
    assert!(STUDY.contains(from), "the small study no longer holds {from}");
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("data.csv"), DATA).unwrap();
    let file = dir.path().join("study.toml");
    fs::write(&file, STUDY.replacen(from, to, 1)).unwrap();
    Case { dir, file }
}

impl Case {
    /// Standard error on one line, after a refusal that left nothing behind.
    fn refused(&self, options: &[&str]) -> String {
        let out = self.dir.path().join("out");
        let mut command = starlings();
        command.arg("explain").arg(&self.file).arg("--out").arg(&out).args(options);
        let (code, stdout, stderr) = output(&mut command);
        assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
        assert!(!out.exists(), "a refused explanation leaves no folder behind");
        // Line breaks of the display may fall anywhere.
        let words = stderr.split_whitespace().filter(|w| !matches!(*w, "│" | "×" | "╰─▶"));
        words.collect::<Vec<_>>().join(" ")
    }

    fn refused_with(&self, options: &[&str], words: &[&str]) {
        let said = self.refused(options);
        for word in words {
            assert!(said.contains(word), "no `{word}` in: {said}");
        }
    }
}

/// The line on which a text stands in the small study, from 1.
fn line_of(text: &str) -> usize {
    STUDY.lines().position(|line| line.contains(text)).unwrap() + 1
}

#[test]
fn a_study_without_training_span_is_refused() {
    let place = format!("study.toml:{}", line_of("[[records]]"));
    case("train = [0.0, 0.3]", "use = \"held-out\"")
        .refused_with(&[], &["every record is held out", "nothing is left to fit", &place]);
    case("train = [0.0, 0.3]", "train = [7.0, 9.0]")
        .refused_with(&[], &["no sample of record `one`", "0 to 0.4"]);
}

#[test]
fn holding_out_every_channel_is_refused() {
    let all = "library = \"study\"\nhold_out_channels = [\"position\", \"speed\"]";
    case("library = \"study\"", all)
        .refused_with(&[], &["every channel", "held out", "nothing is left to fit"]);
}

#[test]
fn a_held_out_column_that_is_fitted_under_another_name_is_refused() {
    let text = STUDY
        .replace("library = \"study\"", "library = \"study\"\nhold_out_channels = [\"speed\"]")
        .replace("value = \"v\" } ]", "value = \"v\" }, { name = \"pace\", unit = \"m/s\", value = \"v\" } ]")
        .replace(
            "noise = 0.1 },\n]",
            "noise = 0.1 },\n  { column = \"speed\", output = \"pace\", noise = 0.1 },\n]",
        );
    let case = case(STUDY, &text);
    case.refused_with(&[], &["column `speed` is held out as `speed` and fitted as `pace`", "keep one"]);
}

#[test]
fn a_term_that_does_not_parse_is_shown_at_its_place() {
    let place = format!("study.toml:{}:36", line_of("-k3*x^3"));
    case("-k3*x^3", "-k3*x^^3").refused_with(&[], &[&place]);
    case("-k3*x^3", "-k3*sine(x)").refused_with(&[], &["sine", "study.toml:"]);
}

#[test]
fn units_of_a_term_that_contradict_its_equation_are_told() {
    let case = case("unit = \"1/m^2/s^2\"", "unit = \"kg\"");
    let (code, stdout, stderr) = output(starlings().arg("check").arg(&case.file));
    assert_eq!(code, 0, "a label is no reason to refuse numbers: {stderr}");
    let told = stdout.lines().find(|line| line.starts_with("warning: units:"));
    assert!(told.is_some_and(|line| line.contains("cubic")), "{stdout}");
}

#[test]
fn a_library_of_nothing_is_refused_with_what_would_help() {
    let from = STUDY.find("[[effects]]").unwrap();
    let to = STUDY.find("[[records]]").unwrap();
    case(&STUDY[from..to], "").refused_with(&[], &["no effect to try", "[[effects]]"]);
    case("library", "library").refused_with(&["--without", "cubic"], &["no effect left to try", "`without`"]);
}

#[test]
fn an_effect_that_does_not_exist_offers_the_nearest() {
    let sound = || case("library", "library");
    sound().refused_with(&["--without", "cubik"], &["no effect is named `cubik`", "did you mean `cubic`?"]);
    sound().refused_with(&["--only", "cubik"], &["no effect is named `cubik`", "did you mean `cubic`?"]);
    let place = format!("study.toml:{}:12", line_of("library") + 1);
    case("library = \"study\"", "library = \"study\"\nwithout = [\"cubik\"]")
        .refused_with(&[], &["no effect is named `cubik`", "did you mean `cubic`?", &place]);
    case("library = \"study\"", "library = \"study\"\nwithout = [\"cubic\"]\nonly = [\"cubic\"]")
        .refused_with(&[], &["both in `only` and in `without`"]);
}

#[test]
fn a_budget_below_one_set_of_runs_is_refused_with_what_it_needs() {
    case("library", "library").refused_with(&["--budget", "1"], &["budget of 1 runs", "fit", "1 more"]);
    case("library = \"study\"", "library = \"study\"\nbudget = 0")
        .refused_with(&[], &["`budget`", "at least 1"]);
}

#[test]
fn at_most_three_effects_can_be_asked_for() {
    case("library = \"study\"", "library = \"study\"\nmax_effects = 4")
        .refused_with(&[], &["`max_effects`", "at most 3", "found 4"]);
}

#[test]
fn a_misspelt_key_of_explain_offers_the_nearest() {
    case("library = \"study\"", "library = \"study\"\nwithuot = []")
        .refused_with(&[], &["withuot", "without"]);
}
