//! Bad studies: each one thing wrong, and the exact message, place and remedy that a user reads.

use std::fmt::Write as _;
use std::path::Path;

use starlings_coordinator::study::{Problem, Study};

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
    match Study::load(&file) {
        Ok(_) => Vec::new(),
        Err(error) => error.problems,
    }
}

/// `line:column: message` and the help of each problem.
fn told(problem: &Problem) -> (String, Option<String>) {
    let (line, column) = problem.line_column().unwrap_or_default();
    let name = problem.file.file_name().unwrap_or(Path::new("").as_os_str()).to_string_lossy().into_owned();
    let folder = format!("{}/", problem.file.parent().unwrap_or(Path::new("")).display());
    (format!("{name}:{line}:{column}: {}", problem.message.replace(&folder, "")), problem.help.clone())
}

/// One replacement in a good study, and what is told about it.
struct Case {
    from: &'static str,
    to: &'static str,
    told: &'static str,
    help: Option<&'static str>,
}

const fn case(from: &'static str, to: &'static str, told: &'static str, help: &'static str) -> Case {
    Case { from, to, told, help: if help.is_empty() { None } else { Some(help) } }
}

fn check(good: &str, cases: &[Case]) {
    let mut wrong = String::new();
    for case in cases {
        assert_eq!(good.matches(case.from).count(), 1, "`{}` is not one place of the study", case.from);
        let found: Vec<_> = problems(&good.replace(case.from, case.to), &recording()).iter().map(told).collect();
        let expected = vec![(case.told.to_owned(), case.help.map(ToOwned::to_owned))];
        if found != expected {
            writeln!(wrong, "{}\n  expected {expected:#?}\n  found {found:#?}", case.to).unwrap();
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn the_unspoilt_studies_are_good() {
    assert_eq!(problems(STUDY, &recording()), []);
    assert_eq!(problems(EQUATIONS, &recording()), []);
}

#[test]
fn faults_of_form_are_told_with_place_and_remedy() {
    check(
        STUDY,
        &[
            case("seed = 3", "sead = 3", "X", ""),
            case("seed = 3", "seed = -3", "X", ""),
            case("seed = 3", "seed = \"three\"", "X", ""),
            case("name = \"aorta\"", "nmae = \"aorta\"", "X", ""),
            case("name = \"aorta\"", "name = \"a/b\"", "X", ""),
            case("name = \"beat\"\n", "", "X", ""),
            case("kind = \"windkessel-3\"", "kind = windkessel", "X", ""),
            case("Zc = 0.1", "Zc = \"a\"", "X", ""),
            case("noise = 2.0", "noise = \"automatic\"", "X", ""),
            case("train = [0.0, 1.0]", "train = [1.0, 0.0]", "X", ""),
            case("kind = \"windkessel-3\"", "kind = \"windkessel-3\"\nstates = []", "X", ""),
            case("[fleet]", "[flaet]", "X", ""),
        ],
    );
}

#[test]
fn names_that_the_model_lacks_offer_the_nearest() {
    check(
        STUDY,
        &[
            case("kind = \"windkessel-3\"", "kind = \"windkesel-3\"", "X", ""),
            case("kind = \"windkessel-3\"", "kind = \"solver\"\ncommand = \"a\"", "X", ""),
            case("name = \"initial:p\"", "name = \"initial:q\"", "X", ""),
            case("Zc = 0.1", "Zc = 0.1, Rc = 1", "X", ""),
            case("Zc = 0.1", "", "X", ""),
            case("Zc = 0.1", "Zc = -0.1", "X", ""),
            case("Zc = 0.1", "Zc = 0.1, R = 1.0", "X", ""),
            case("name = \"C\"", "name = \"R\"", "X", ""),
            case("output = \"pressure\"", "output = \"presure\"", "X", ""),
            case("flow = \"flow\"", "flwo = \"flow\"", "X", ""),
            case("median_from = \"pressure\"", "median_from = \"flow\"", "X", ""),
            case("kind = \"none\"", "kind = \"nuding\"", "X", ""),
            case("[estimator]", "[explain]\nhold_out_channels = [\"presure\"]\n\n[estimator]", "X", ""),
        ],
    );
}

#[test]
fn priors_that_make_no_sense_are_refused() {
    check(
        STUDY,
        &[
            case("median = 3.0, factor = 2.0", "median = 0.0, factor = 2.0", "X", ""),
            case("median = 3.0, factor = 2.0", "median = 3.0, factor = 1.0", "X", ""),
            case("median = 3.0, factor = 2.0", "median = 3.0", "X", ""),
            case("median = 3.0, factor = 2.0", "factor = 2.0", "X", ""),
            case("median = 3.0, factor = 2.0", "median = 3.0, factor = 2.0, sd = 1.0", "X", ""),
            case("transform = \"log\", median = 3.0, factor", "transform = \"linear\", median = -3.0, sd", "X", ""),
            case("sd = 10.0", "factor = 2.0", "X", ""),
            case("sd = 10.0", "sd = 0.0", "X", ""),
            case("\"logit(0.1, 5)\", median = 1.0", "\"logit(0.1, 5)\", median = 6.0", "X", ""),
            case("logit(0.1, 5)", "logit(5, 0.1)", "X", ""),
            case("logit(0.1, 5)", "logit(-1, 5)", "X", ""),
            case("logit(0.1, 5)", "logit", "X", ""),
            case("logit(0.1, 5)", "lgo", "X", ""),
            case("unit = \"mmHg s/mL\"", "process = { forgetting = 1.5 }", "X", ""),
        ],
    );
}

#[test]
fn settings_that_cannot_work_are_refused() {
    check(
        STUDY,
        &[
            case("gain = 0.0", "gain = -1.0", "X", ""),
            case("workers = 2", "workers = 0", "X", ""),
            case("passes = 2", "passes = 0", "X", ""),
            case("points = \"simplex\"", "points = \"simplx\"", "X", ""),
            case("points = \"simplex\"", "points = \"star\"\nkappa = 1.0", "X", ""),
            case("kind = \"roukf\"", "kind = \"enkf\"", "X", ""),
            case("train = [0.0, 1.0]", "use = \"held-out\"", "X", ""),
            case("train = [0.0, 1.0]", "every = 0", "X", ""),
            case("[estimator]", "[explain]\nhold_out_channels = [\"pressure\"]\n\n[estimator]", "X", ""),
        ],
    );
}

#[test]
fn recordings_that_do_not_fit_are_refused_at_the_study_line() {
    check(
        STUDY,
        &[
            case("file = \"beat.csv\"", "file = \"baet.csv\"", "X", ""),
            case("file = \"beat.csv\"", "file = \"beat.csv\"\ntime = \"t\"", "X", ""),
            case("column = \"pressure\"", "column = \"presure\"", "X", ""),
            case("column = \"pressure\"", "column = \"empty\"", "X", ""),
            case("column = \"pressure\"", "column = \"late\"", "X", ""),
            case("flow = \"flow\"", "flow = \"gaps\"", "X", ""),
            case("flow = \"flow\"", "flow = \"other.csv:flow\"", "X", ""),
            case("train = [0.0, 1.0]", "train = [5.0, 6.0]", "X", ""),
            case("noise = 2.0", "noise = 0", "X", ""),
            case("pressure\", noise = 2.0 }", "pressure\", noise = 2.0 }, { column = \"flow\", output = \"pressure\", noise = 1.0 }", "X", ""),
        ],
    );
}

#[test]
fn an_expression_fault_has_its_caret_under_the_character() {
    check(
        EQUATIONS,
        &[
            case("\"-k*x/m\"", "\"-k*x/(m\"", "X", ""),
            case("\"-k*x/m\"", "\"-k*\\u0078 x/m\"", "X", ""),
            case("\"-c*v/m\"", "\"-c*vv/m\"", "X", ""),
            case("\"-c*v/m\"", "\"-c*sinn(v)/m\"", "X", ""),
            case("value = \"x\"", "value = \"x +\"", "X", ""),
            case("initial = 0.1", "initial = \"2*v\"", "X", ""),
            case("outputs = [", "replaceable = [\"viscuos\"]\noutputs = [", "X", ""),
            case("outputs = [", "solver = { method = \"euler\" }\noutputs = [", "X", ""),
            case("name = \"v\"", "name = \"x\"", "X", ""),
            case("rate = \"v\"", "rate = 1.0", "X", ""),
        ],
    );
}

#[test]
fn a_fault_in_a_recording_is_told_at_its_cell() {
    let rows = |rows: &str| format!("time,pressure,flow\n{rows}");
    let cases: &[(&str, &str, &str)] = &[
        ("0,90,1\n0.5,91,1\n0.4,92,1\n", "X", ""),
        ("0,90,1\n0.5,91,1\n\n0.5,92,1\n", "X", ""),
        ("0,90,1\n0.5,high,1\n0.6,higher,1\n", "X", ""),
        ("0,90,1\n,91,1\n", "X", ""),
        ("0,90,1\n0.5,91\n", "X", ""),
        ("0,90,1\n\"0.5\",91,inf\n", "X", ""),
        ("0,90,1\n0.5,91,\n", "X", ""),
        ("", "X", ""),
    ];
    let mut wrong = String::new();
    for (text, expected, help) in cases {
        let found: Vec<_> = problems(STUDY, &rows(text)).iter().map(told).collect();
        if found != [((*expected).to_owned(), Some((*help).to_owned()).filter(|h| !h.is_empty()))] {
            writeln!(wrong, "{text:?}\n  found {found:#?}").unwrap();
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn every_fault_of_a_kind_is_told_at_once() {
    let study = STUDY
        .replace("factor = 2.0 }\n\n[[parameters]]\nname = \"initial:p\"", "factor = 0.5 }\n\n[[parameters]]\nname = \"initial:x\"")
        .replace("workers = 2", "workers = 0")
        .replace("column = \"pressure\"", "column = \"p\"");
    let lines: Vec<usize> =
        problems(&study, &recording()).iter().filter_map(|p| p.line_column()).map(|(line, _)| line).collect();
    assert_eq!(lines, [39, 12, 15, 30], "fleet, factor, name, column");
}

#[test]
fn a_study_that_is_not_there_is_one_plain_problem() {
    let error = Study::load(Path::new("/nowhere/study.toml")).unwrap_err();
    assert!(error.to_string().starts_with("/nowhere/study.toml: cannot read the study: "), "{error}");
}
