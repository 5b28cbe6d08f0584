//! A recording under a study that reads three of its columns.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use starlings_study::Study;
use tempfile::TempDir;

const STUDY: &str = r#"
[study]
name = "fuzz"
seed = 1

[model]
kind = "windkessel-3"
constants = { C = 1.5, Zc = 0.05 }

[[parameters]]
name = "R"
prior = { distribution = "lognormal", median = 1.0, factor = 2.0 }

[[records]]
name = "one"
file = "data.csv"
time = "t"
inputs = { flow = "flow" }
channels = [ { column = "pressure", output = "pressure", noise = "auto" } ]
"#;

static FOLDER: LazyLock<(TempDir, PathBuf)> = LazyLock::new(|| {
    let folder = TempDir::new().expect("a folder");
    let study = folder.path().join("study.toml");
    (folder, study)
});

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(FOLDER.0.path().join("data.csv"), bytes).expect("room");
    match Study::from_text(&FOLDER.1, STUDY) {
        Ok(study) => assert!(study.records.iter().all(|record| record.times.iter().all(|t| t.is_finite()))),
        Err(error) => assert!(!error.problems.is_empty(), "a refusal says why"),
    }
});
