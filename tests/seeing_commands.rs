//! `starlings compare` and `starlings why`: what they say of real runs, and what they refuse.

mod common;

use std::path::{Path, PathBuf};

use common::{output, starlings};
use serde_json::Value;

/// A finished run of a small study.
fn run(folder: &Path, name: &str) -> PathBuf {
    let out = folder.join(name);
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/rcr/study.toml");
    let (code, _, stderr) =
        output(starlings().arg("run").arg(study).args(["--workers", "1", "--out"]).arg(&out));
    assert_eq!(code, 0, "{stderr}");
    out
}

fn json(arguments: &[&str]) -> Value {
    let (code, stdout, stderr) = output(starlings().args(arguments).arg("--json"));
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).expect("JSON and nothing else")
}

#[test]
fn two_runs_of_one_study_are_the_same_to_the_bit_and_questions_about_them_are_answered() {
    let folder = tempfile::tempdir().expect("a folder");
    let [one, two] = ["one", "two"].map(|name| run(folder.path(), name));
    let [one, two] = [one.to_str().expect("UTF-8"), two.to_str().expect("UTF-8")];
    let found = json(&["compare", one, two]);
    assert_eq!(found["settings"], Value::Array(Vec::new()));
    for parameter in found["parameters"].as_array().expect("parameters") {
        assert_eq!(parameter["values"][0], parameter["values"][1]);
        assert_eq!(parameter["apart"], 0.0);
    }
    assert_eq!(found["evidence"]["below_best"], serde_json::json!([0.0, 0.0]));
    let page = folder.path().join("compared.html");
    let (code, stdout, stderr) = output(starlings().args(["compare", one, two, "--html"]).arg(&page));
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("agree within two standard deviations") && page.is_file(), "{stdout}");
    let name = found["parameters"][0]["name"].as_str().expect("a name").to_owned();
    let answer = json(&["why", one, &name]);
    assert_eq!(answer["about"], format!("parameter {name}"));
    assert!(answer["says"][0].as_str().expect("a sentence").starts_with("It went from "), "{answer}");
    let (code, stdout, _) = output(starlings().args(["why", one]));
    assert!(code == 0 && stdout.contains("It is finished"), "{stdout}");
    let refused: [(&[&str], &str); 5] = [
        (&["why", one, "no-such-thing"], "nothing in this run is called `no-such-thing`"),
        (&["why", "nowhere"], "no run in nowhere"),
        (&["compare", one], "DIR"),
        (&["compare", one, "nowhere"], "no run in nowhere"),
        (&["compare", one, two, "--html", &format!("{one}/report.html")], "is in the folder of a run"),
    ];
    for (arguments, expected) in refused {
        let (code, stdout, stderr) = output(starlings().args(arguments));
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}
