//! Values that stand apart from all around them: left out and told, kept where the study says so, and what an estimate is with them.
#![allow(clippy::unwrap_used)]
mod study_kit;

use starlings_coordinator::fleet::InProcess;
use starlings_coordinator::study::{SolverHost, Study};
use study_kit::{Case, csv};

const SPIKES: [(usize, f64); 2] = [(30, 25.0), (71, 40.0)];

/// A cooling body, y = 20 + 60 exp(−t/8), read to a tenth, with these values added; `more` stands in the channel.
fn cooling(added: &[(usize, f64)], more: &str) -> Case {
    asking(added, more, "")
}

/// The same study with this behind it.
fn asking(added: &[(usize, f64)], more: &str, ask: &str) -> Case {
    let times: Vec<f64> = (0..120).map(|i| 0.25 * f64::from(i)).collect();
    let mut y: Vec<f64> =
        times.iter().map(|t| (10.0 * (20.0 + 60.0 * (-t / 8.0).exp())).round() / 10.0).collect();
    for (at, value) in added {
        y[*at] += value;
    }
    let study = format!(
        r#"
[study]
name = "cooling"
[model]
kind = "equations"
constants = {{ room = 20.0 }}
outputs = [ {{ name = "body", unit = "degC", value = "temperature" }} ]
[[model.states]]
name = "temperature"
unit = "degC"
initial = 80.0
rate = "(room - temperature)/tau"
[[parameters]]
name = "tau"
unit = "s"
prior = {{ transform = "log", median = 6.0, factor = 2.0 }}
[[records]]
name = "monday"
file = "cooling.csv"
train = [0, 25]
channels = [ {{ column = "body", output = "body", {more} }} ]
{ask}
"#
    );
    Case::new(&study, &[("cooling.csv", csv("time,body", &[&times, &y]))])
}

/// Rows of the file that are no times of the record: a time without any value is none.
fn missing(study: &Study) -> Vec<usize> {
    let times = &study.records[0].times;
    (0..120).filter(|i| !times.iter().any(|t| (t / 0.25).round() as usize == *i)).collect()
}

#[test]
fn an_outlier_counts_as_missing_and_is_told_with_its_line() {
    let study = cooling(&SPIKES, "noise = 0.05").study();
    assert_eq!(missing(&study), [30, 71]);
    let [told] = study.warnings.as_slice() else { panic!("{:?}", study.warnings) };
    let begins =
        "2 values in column `body` of record `monday` are left out (lines 32, 73 of `cooling.csv`): each is ";
    assert!(told.starts_with(begins) && told.contains("`outliers = \"keep\"`"), "{told}");
    let one = cooling(&SPIKES[..1], "noise = 0.05").study();
    assert!(
        one.warnings[0].contains("a value in column `body` of record `monday` is left out (line 32 of"),
        "{:?}",
        one.warnings
    );
    assert!(cooling(&[], "noise = 0.05").study().warnings.is_empty());
}

#[test]
fn a_first_or_last_value_that_stands_apart_is_kept_and_told_with_its_line() {
    let first = cooling(&[(0, 3.0)], "noise = 0.05").study();
    assert_eq!(missing(&first), [0; 0]);
    let [told] = first.warnings.as_slice() else { panic!("{:?}", first.warnings) };
    let begins = "the first value in column `body` of record `monday` (line 2 of `cooling.csv`) stands apart";
    assert!(told.starts_with(begins) && told.contains("empty the cell of a fault"), "{told}");
    let both = cooling(&[(0, 3.0), (119, -3.0)], "noise = 0.05").study();
    assert!(both.warnings[0].contains("and so does one more at an end of a column"), "{:?}", both.warnings);
    assert!(cooling(&[(0, 3.0)], "noise = 0.05, outliers = \"keep\"").study().warnings.is_empty());
}

#[test]
fn it_is_kept_where_the_channel_says_so_and_where_too_many_are_like_it() {
    let kept = cooling(&SPIKES, "noise = 0.05, outliers = \"keep\"").study();
    assert_eq!((missing(&kept).len(), kept.warnings.len()), (0, 0));
    let said = cooling(&SPIKES, "noise = 0.05, outliers = \"leave-out\"").study();
    assert_eq!(missing(&said), [30, 71]);
    let pulses: Vec<(usize, f64)> = (1..10).map(|k| (11 * k, 30.0)).collect();
    let many = cooling(&pulses, "noise = 0.05").study();
    assert_eq!(missing(&many), [0; 0]);
    assert!(
        many.warnings[0].starts_with("9 of 120 values in column `body` of record `monday` stand apart"),
        "{:?}",
        many.warnings
    );
    let unknown = cooling(&[], "noise = 0.05, outliers = \"drop\"").refusal().unwrap();
    assert!(unknown.contains("unknown treatment of outliers `drop`"), "{unknown}");
}

#[test]
fn an_estimate_and_a_noise_that_is_found_are_those_of_the_record_without_it() {
    let estimate = |added: &[(usize, f64)], more: &str| {
        let case = cooling(added, more);
        let done = case.run_on(&mut InProcess::new(2)).unwrap();
        (done.summary.parameters[0].estimate, case.study().records[0].channels[0].noise)
    };
    let (clean, found) = estimate(&[], "noise = \"auto\"");
    let (spoiled, of_all) = estimate(&SPIKES, "noise = \"auto\", outliers = \"keep\"");
    let (mended, of_rest) = estimate(&SPIKES, "noise = \"auto\"");
    assert!((clean - 8.0).abs() < 0.01, "{clean}");
    assert!(
        (mended - clean).abs() < 0.01 && (of_rest / found - 1.0).abs() < 0.1,
        "{mended} {of_rest} {found}"
    );
    assert!(
        (spoiled - clean).abs() > 3.0 * (mended - clean).abs().max(0.01),
        "{spoiled} with noise {of_all}"
    );
}

#[test]
fn a_diagnosis_keeps_every_value_unless_the_study_says_otherwise() {
    let scenario = r#"
[[diagnose.scenarios]]
name = "draught"
parameters = [ { name = "room", unit = "degC", prior = { transform = "linear", median = 10.0, sd = 5.0 } } ]
"#;
    for (more, wanted) in [("noise = 0.05", 0), ("noise = 0.05, outliers = \"leave-out\"", 2)] {
        let case = asking(&SPIKES, more, scenario);
        let path = case.fresh().with_file_name("study.toml");
        let diagnosis = Study::load_for_diagnosis(&path, &SolverHost::default())
            .unwrap_or_else(|error| panic!("{error}"));
        let studies = [&diagnosis.healthy, &diagnosis.scenarios[0].study];
        assert_eq!(studies.map(|study| missing(study).len()), [wanted; 2], "{more}");
    }
}
