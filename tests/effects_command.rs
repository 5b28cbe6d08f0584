//! `starlings effects`: the catalogue, and what would be tried for a study.

#![allow(clippy::unwrap_used)] // a failed unwrap is a failed test

mod common;

use std::path::Path;

use common::{output, repository, starlings};
use serde_json::Value;

/// A study of a driven oscillator whose recording is never read further than to check it.
fn study(dir: &Path, explain: &str) -> std::path::PathBuf {
    let row = |i: i32| format!("{},{}\n", f64::from(i) * 0.1, (f64::from(i) * 0.3).sin());
    let rows: Vec<String> = (0..20).map(row).collect();
    std::fs::write(dir.join("data.csv"), format!("time,x\n{}", rows.concat())).unwrap();
    let text = format!(
        r#"
[study]
name = "mass"
[model]
kind = "oscillator"
constants = {{ m = 1.0, c = 0.1 }}
[[parameters]]
name = "k"
prior = {{ transform = "log", median = 9.0, factor = 2.0 }}
[[records]]
name = "one"
file = "data.csv"
time = "time"
channels = [{{ column = "x", output = "position", noise = 0.1 }}]
[[effects]]
name = "magnet"
says = "A magnet holds the mass near rest."
adds = [{{ to = "v", term = "-pull*x*exp(-x^2)" }}]
parameters = [{{ name = "pull", range = [0, 50] }}]
{explain}
"#
    );
    let file = dir.join("study.toml");
    std::fs::write(&file, text).unwrap();
    file
}

fn listed(arguments: &[&str]) -> Vec<Value> {
    let (code, stdout, stderr) = output(starlings().arg("effects").args(arguments).arg("--json"));
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).unwrap()
}

fn names(effects: &[Value]) -> Vec<&str> {
    effects.iter().map(|effect| effect["name"].as_str().unwrap()).collect()
}

#[test]
fn the_catalogue_has_every_family_with_sentences_and_sources() {
    let (code, stdout, stderr) = output(starlings().arg("effects"));
    assert_eq!(code, 0, "{stderr}");
    for family in ["Mechanics", "Hydraulics", "Thermal", "Propulsion", "Haemodynamics", "Sensors", "Inputs"] {
        assert!(stdout.lines().any(|line| line == family), "{family}: {stdout}");
    }
    let effects = listed(&[]);
    assert!(effects.len() > 40, "{}", effects.len());
    for effect in &effects {
        assert!(stdout.contains(effect["says"].as_str().unwrap()), "{effect}");
        assert!(!effect["source"].as_str().unwrap().is_empty(), "{effect}");
        assert!(!effect["parameters"].as_array().unwrap().is_empty(), "{effect}");
    }
}

#[test]
fn a_study_lists_its_own_effects_and_those_with_a_place_in_its_model() {
    let dir = tempfile::tempdir().unwrap();
    let file = study(dir.path(), "");
    let effects = listed(&[file.to_str().unwrap()]);
    let found = names(&effects);
    assert!(found.contains(&"magnet") && found.contains(&"coulomb-friction"), "{found:?}");
    assert!(!found.contains(&"series-resistance"), "{found:?}");
    let family = |name: &str| effects.iter().find(|e| e["name"] == name).unwrap()["family"].clone();
    assert_eq!((family("magnet"), family("coulomb-friction")), ("study".into(), "mechanics".into()));
    let (_, stdout, _) = output(starlings().arg("effects").arg(&file));
    assert!(stdout.contains("-pull*x*exp(-x^2)") && stdout.contains("c_quadratic"), "{stdout}");
}

#[test]
fn the_library_of_the_study_decides_what_is_listed() {
    let dir = tempfile::tempdir().unwrap();
    let file = study(dir.path(), "[explain]\nlibrary = \"study\"");
    assert_eq!(names(&listed(&[file.to_str().unwrap()])), ["magnet"]);
    let file = study(dir.path(), "[explain]\nlibrary = \"built-in\"");
    let effects = listed(&[file.to_str().unwrap()]);
    assert!(!names(&effects).contains(&"magnet") && effects.len() > 10, "{:?}", names(&effects));
}

#[test]
fn a_windkessel_could_lack_a_series_resistance() {
    let effects = listed(&[repository("examples/pig-aorta/study.toml").to_str().unwrap()]);
    assert!(names(&effects).contains(&"series-resistance"), "{:?}", names(&effects));
}

#[test]
fn what_changes_a_spring_is_listed_where_the_model_has_one() {
    let dir = tempfile::tempdir().unwrap();
    let oscillator = listed(&[study(dir.path(), "").to_str().unwrap()]);
    let falling = listed(&[repository("examples/falling-balls/study.toml").to_str().unwrap()]);
    let (oscillator, falling) = (names(&oscillator), names(&falling));
    for name in ["quadratic-stiffness", "cubic-stiffness", "backlash"] {
        assert!(
            oscillator.contains(&name) && !falling.contains(&name),
            "{name}: {oscillator:?}, {falling:?}"
        );
    }
    assert!(
        falling.contains(&"dead-zone") && falling.contains(&"linear-support"),
        "they may come: {falling:?}"
    );
}

#[test]
fn a_study_that_is_not_there_is_wrong_input() {
    let (code, _, stderr) = output(starlings().args(["effects", "no-such.toml"]));
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("no-such.toml"), "{stderr}");
}
