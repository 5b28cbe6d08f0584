//! A study of its own for `starlings identify`, and the reading of what it prints.

#![allow(dead_code, clippy::unwrap_used)] // every test file uses its own part; a failed unwrap is a failed test

use std::path::PathBuf;

use serde_json::Value;

use crate::common::{output, starlings};

/// A study in a folder of its own.
pub(crate) struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    pub(crate) fn new(study: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("study.toml"), study).unwrap();
        Self { folder }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn with(self, name: &str, text: &str) -> Self {
        std::fs::write(self.path(name), text).unwrap();
        self
    }

    pub(crate) fn identify(&self, extra: &[&str]) -> (i32, String, String) {
        output(starlings().arg("identify").arg(self.path("study.toml")).args(extra))
    }

    pub(crate) fn json(&self, extra: &[&str]) -> Value {
        let (code, stdout, stderr) = self.identify(&[&["--json"], extra].concat());
        assert_eq!(code, 0, "{stderr}");
        parse(&stdout)
    }
}

pub(crate) fn parse(stdout: &str) -> Value {
    serde_json::from_str(stdout).unwrap_or_else(|e| panic!("{e}: {stdout}"))
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

pub(crate) fn parameter<'a>(found: &'a Value, name: &str) -> &'a Value {
    let of_name = |p: &&Value| p["name"] == name;
    found["parameters"].as_array().unwrap().iter().find(of_name).unwrap()
}

pub(crate) fn warns(found: &Value, words: &[&str]) -> bool {
    let warnings = found["warnings"].as_array().unwrap();
    warnings.iter().any(|w| words.iter().all(|word| w.as_str().unwrap().contains(word)))
}
