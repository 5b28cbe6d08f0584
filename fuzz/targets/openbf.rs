//! A network of openBF, with an inflow beside it.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tempfile::TempDir;

/// A folder with the inflow that the examples name.
static FOLDER: LazyLock<(TempDir, PathBuf)> = LazyLock::new(|| {
    let folder = TempDir::new().expect("a folder");
    std::fs::write(folder.path().join("cca_inlet.dat"), "0 1e-6\n0.5 2e-6\n1 1e-6\n").expect("room");
    let file = folder.path().join("network.yaml");
    (folder, file)
});

fuzz_target!(|text: &str| {
    // A path that leaves the folder reads this machine, which is no input.
    if text.contains('/') || text.contains("..") {
        return;
    }
    if let Err(message) = starlings_draft::import::fuzzing::openbf(&FOLDER.1, text) {
        assert!(!message.is_empty(), "a refusal says why");
    }
});
