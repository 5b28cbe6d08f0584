//! What the tests of spectra share.
#![allow(dead_code)] // each test file uses its own part

/// Names of whole outputs.
pub(crate) fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|&name| name.to_owned()).collect()
}

/// Holds a figure to an expected one.
pub(crate) fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() <= tolerance, "{what}: {found} where {expected} was expected");
}
