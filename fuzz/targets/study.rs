//! A study file, with a recording beside it that it may name.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use starlings_study::Study;
use tempfile::TempDir;

/// A folder with `data.csv`.
static FOLDER: LazyLock<(TempDir, PathBuf)> = LazyLock::new(|| {
    let folder = TempDir::new().expect("a folder");
    std::fs::write(folder.path().join("data.csv"), "t,flow,pressure\n0,1,90\n0.5,2,95\n1,1,91\n").expect("room");
    let study = folder.path().join("study.toml");
    (folder, study)
});

fuzz_target!(|text: &str| {
    // A path that leaves the folder reads this machine, which is no input.
    if text.contains("/dev") || text.contains("..") {
        return;
    }
    if let Err(error) = Study::from_text(&FOLDER.1, text) {
        assert!(!error.problems.is_empty(), "a refusal says why");
    }
});
