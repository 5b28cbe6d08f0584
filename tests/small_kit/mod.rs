//! The small study that tests of bad input spoil: one record of five samples.

#![allow(dead_code)] // every test file uses its own part

use std::fs;
use std::path::PathBuf;

pub(crate) const DATA: &str =
    "time,pressure,flow\n0.0,100.0,0.0\n0.1,101.0,10.0\n0.2,103.0,30.0\n0.3,102.0,5.0\n0.4,101.0,0.0\n";

pub(crate) const STUDY: &str = r#"[study]
name = "small"

[model]
kind = "windkessel-2"

[[parameters]]
name = "R"
prior = { transform = "log", median = 3.0, factor = 2.0 }

[[parameters]]
name = "C"
prior = { transform = "log", median = 1.0, factor = 2.0 }

[[records]]
name = "one"
file = "data.csv"
time = "time"
inputs = { flow = "flow" }
channels = [ { column = "pressure", output = "pressure", noise = 2.0 } ]

[estimator]
kind = "roukf"

[fleet]
workers = 1
"#;

/// A folder with the small study after `edit`, and its recording after `edit_data`.
pub(crate) fn study(
    edit: impl Fn(String) -> String,
    edit_data: impl Fn(String) -> String,
) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let edited = edit(STUDY.to_owned());
    fs::write(dir.path().join("data.csv"), edit_data(DATA.to_owned())).unwrap();
    let file = dir.path().join("study.toml");
    fs::write(&file, edited).unwrap();
    (dir, file)
}

pub(crate) fn same(text: String) -> String {
    text
}

pub(crate) fn swap(from: &'static str, to: &'static str) -> impl Fn(String) -> String {
    move |text| {
        assert!(text.contains(from), "the small study no longer holds {from}");
        text.replacen(from, to, 1)
    }
}
