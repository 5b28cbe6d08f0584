//! Bad studies: each one thing wrong, and the exact message, place and remedy that a user reads.
// The helpers of a test file are tests too.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::Path;

use starlings_coordinator::study::{Problem, SolverHost, Study};

/// A good study of an aortic recording; every case spoils one place of it.
const STUDY: &str = r#"[study]
name = "aorta"
seed = 3

[model]
kind = "windkessel-3"
constants = { Zc = 0.1 }

[[parameters]]
name = "R"
unit = "mmHg s/mL"
prior = { transform = "log", median = 3.0, factor = 2.0 }

[[parameters]]
name = "initial:p"
prior = { transform = "linear", median_from = "pressure", sd = 10.0 }

[[parameters]]
name = "C"
prior = { transform = "logit(0.1, 5)", median = 1.0, factor = 2.0 }

[observer]
kind = "none"
gain = 0.0

[[records]]
name = "beat"
file = "beat.csv"
inputs = { flow = "flow" }
channels = [ { column = "pressure", output = "pressure", noise = 2.0 } ]
train = [0.0, 1.0]

[estimator]
kind = "roukf"
points = "simplex"
passes = 2

[fleet]
workers = 2
"#;

/// An oscillator written as equations; it needs no recording of inputs.
const EQUATIONS: &str = r#"[study]
name = "spring"

[model]
kind = "equations"
constants = { m = 1.0 }
outputs = [ { name = "position", unit = "m", value = "x" } ]

[[model.states]]
name = "x"
initial = 0.1
rate = "v"

[[model.states]]
name = "v"
rate = { spring = "-k*x/m", viscous = "-c*v/m" }

[[parameters]]
name = "k"
prior = { transform = "log", median = 3.0, factor = 2.0 }

[[parameters]]
name = "c"
prior = { transform = "log", median = 0.1, factor = 2.0 }

[[records]]
name = "swing"
file = "beat.csv"
channels = [ { column = "pressure", output = "position", noise = 2.0 } ]
"#;

fn recording() -> String {
    let mut text = "time,pressure,flow,empty,gaps,late\n".to_owned();
    for i in 0..40 {
        let t = 0.05 * f64::from(i);
        let gap = if i == 3 { String::new() } else { format!("{i}") };
        let late = if i > 30 { "1.5" } else { "" };
        writeln!(text, "{t:.2},{:.3},{:.3},,{gap},{late}", 90.0 + 20.0 * t.sin(), 50.0 * t.cos()).unwrap();
    }
    text
}

fn problems(study: &str, recording: &str) -> Vec<Problem> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("beat.csv"), recording).unwrap();
    let file = folder.path().join("study.toml");
    std::fs::write(&file, study).unwrap();
    match Study::load_with(&file, &SolverHost::default().by(starlings_solver::adapters())) {
        Ok(_) => Vec::new(),
        Err(error) => error.problems,
    }
}

/// `file:line:column: message`, and the help where there is one.
fn told(problem: &Problem) -> Vec<String> {
    let (line, column) = problem.line_column().unwrap_or_default();
    let name = problem.file.file_name().unwrap_or(Path::new("").as_os_str()).to_string_lossy().into_owned();
    let folder = format!("{}/", problem.file.parent().unwrap_or(Path::new("")).display());
    let mut lines = vec![format!("{name}:{line}:{column}: {}", problem.message.replace(&folder, ""))];
    lines.extend(problem.help.iter().map(|help| format!("help: {help}")));
    lines
}

/// Spoils a good study one place at a time and compares what is told. A case is a block of lines: `- ` the place, `+ ` what
/// is put there, then each problem as `file:line:column: message` and `help: ...` where there is one.
fn check(good: &str, cases: &str) {
    let mut wrong = String::new();
    for case in cases.trim_end().split("\n\n") {
        let part = |sign: char| {
            let lines: Vec<&str> =
                case.lines().filter_map(|l| l.strip_prefix(sign)).map(str::trim_start).collect();
            lines.join("\n")
        };
        let (from, to) = (part('-'), part('+'));
        assert_eq!(good.matches(&from).count(), 1, "`{from}` is not one place of the study");
        let expected: Vec<&str> = case.lines().filter(|l| !l.starts_with(['-', '+'])).collect();
        let found: Vec<String> =
            problems(&good.replace(&from, &to), &recording()).iter().flat_map(told).collect();
        if found != expected {
            writeln!(wrong, "+ {to}\n{}\n", found.join("\n")).unwrap();
        }
    }
    assert!(wrong.is_empty(), "told instead:\n{wrong}");
}

#[test]
fn the_unspoilt_studies_are_good() {
    assert_eq!(problems(STUDY, &recording()), []);
    assert_eq!(problems(EQUATIONS, &recording()), []);
}

#[test]
fn faults_of_form_are_told_with_place_and_remedy() {
    check(STUDY, include_str!("study_file/form.txt"));
}

#[test]
fn names_that_the_model_lacks_offer_the_nearest() {
    check(STUDY, include_str!("study_file/names.txt"));
}

#[test]
fn priors_that_make_no_sense_are_refused() {
    check(STUDY, include_str!("study_file/priors.txt"));
}

#[test]
fn settings_that_cannot_work_are_refused() {
    check(STUDY, include_str!("study_file/settings.txt"));
}

#[test]
fn recordings_that_do_not_fit_are_refused_at_the_study_line() {
    check(STUDY, include_str!("study_file/recordings.txt"));
}

#[test]
fn an_expression_fault_has_its_caret_under_the_character() {
    check(EQUATIONS, include_str!("study_file/expressions.txt"));
}

#[test]
fn a_fault_in_a_recording_is_told_at_its_cell() {
    let rows = |rows: &str| format!("time,pressure,flow\n{rows}");
    let cases: &[(&str, &str, &str)] = &[
        (
            "0,90,1\n0.5,91,1\n0.4,92,1\n",
            "beat.csv:4:1: time goes back from 0.5 (line 3) to 0.4 (line 4)",
            "times must increase from row to row: sort the rows, or split the file into records",
        ),
        (
            "0,90,1\n0.5,91,1\n\n0.5,92,1\n",
            "beat.csv:5:1: duplicate time 0.5 on lines 3 and 5",
            "times must increase from row to row: keep one of the rows, or average them",
        ),
        (
            "0,90,1\n0.5,high,1\n0.6,higher,1\n",
            "beat.csv:3:5: `high` in column `pressure` is not a finite number, nor is one other cell of this column",
            "write a number with a decimal point; leave a missing value empty",
        ),
        ("0,90,1\n,91,1\n", "beat.csv:3:1: the time in column `time` is missing", "every row needs its time"),
        (
            "0,90,1\n0.5,91\n",
            "beat.csv:3:1: this row has 2 cells, the header has 3",
            "leave a missing value empty between its commas",
        ),
        (
            "0,90,1\n\"0.5\",91,inf\n",
            "beat.csv:3:10: `inf` in column `flow` is not a finite number",
            "write a number with a decimal point; leave a missing value empty",
        ),
        (
            "0,90,1\n0.5,91,\n",
            "beat.csv:3:8: input column `flow` misses 1 value, the first on line 3 at time = 0.5",
            "an input must be complete: fill it, or put it into a file with a `time` column of its own, as \"other.csv:flow\"",
        ),
        ("", "beat.csv:2:1: the file has a header and no row", ""),
    ];
    for (text, expected, help) in cases {
        let found: Vec<String> = problems(STUDY, &rows(text)).iter().flat_map(told).collect();
        let help = (!help.is_empty()).then(|| format!("help: {help}"));
        let expected: Vec<String> = std::iter::once((*expected).to_owned()).chain(help).collect();
        assert_eq!(found, expected, "{text:?}");
    }
}

#[test]
fn every_fault_of_a_kind_is_told_at_once() {
    let study = STUDY
        .replace(
            "factor = 2.0 }\n\n[[parameters]]\nname = \"initial:p\"",
            "factor = 0.5 }\n\n[[parameters]]\nname = \"initial:x\"",
        )
        .replace("workers = 2", "workers = 0")
        .replace("column = \"pressure\"", "column = \"p\"");
    let lines: Vec<usize> = problems(&study, &recording())
        .iter()
        .filter_map(Problem::line_column)
        .map(|(line, _)| line)
        .collect();
    assert_eq!(lines, [12, 15, 30, 39], "factor, name, column, workers");
}

#[test]
fn an_almost_empty_study_is_told_all_that_it_lacks() {
    let study = "[study]\nname = \"a\"\n[model]\nkind = \"oscillator\"\n";
    let told: Vec<String> = problems(study, "").iter().map(|p| p.message.clone()).collect();
    assert!(told.iter().any(|m| m == "the study has no parameter to estimate"), "{told:?}");
    assert!(told.iter().any(|m| m == "the study has no record"), "{told:?}");
    let told: Vec<String> = problems("", "").iter().flat_map(self::told).collect();
    assert_eq!(
        told,
        [
            "study.toml:1:1: the study needs `study`: a section `[study]` with a `name`",
            "study.toml:1:1: the study needs `model`: a section `[model]` with a `kind`"
        ]
    );
}

#[test]
fn a_study_that_is_not_there_is_one_plain_problem() {
    let error = Study::load(Path::new("/nowhere/study.toml")).unwrap_err();
    assert!(error.to_string().starts_with("/nowhere/study.toml: cannot read the study: "), "{error}");
}
