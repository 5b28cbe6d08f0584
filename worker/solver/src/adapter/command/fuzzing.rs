//! What the fuzzer reaches.

use std::collections::BTreeMap;

use super::program::Output;
use super::results::RunResults;
use super::rule::{Rule, STANDARD_OUTPUT};
use super::template::Templates;

/// Reads two outputs at two times by a rule of the standard output.
pub(crate) fn results(rule: &str, written: &str) {
    let Ok(rule) = Rule::parse(rule, "y") else { return };
    // A file would have to be written for every try.
    if rule.file() != STANDARD_OUTPUT {
        return;
    }
    let output = Output { bytes: written.as_bytes().to_vec(), cut: false };
    let nowhere = std::path::Path::new("/nonexistent");
    if let Ok(values) = RunResults::new(nowhere, &output).values(&rule, 2, &[0.0, 1.0]) {
        assert_eq!(values.len(), 4);
    }
}

/// Reads a template.
pub(crate) fn template(text: &str) {
    let _ = Templates::parsed(&BTreeMap::from([("input.txt".to_owned(), text.to_owned())]));
}
