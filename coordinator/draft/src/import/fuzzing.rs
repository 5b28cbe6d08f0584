//! Entrances of the fuzzer, there only for it: readers of files of other programs, without the study that is written of them.

use std::path::Path;

use super::{openbf, svzerod};

/// Reads a network of svZeroDSolver.
///
/// # Errors
/// With what is wrong in the file.
pub fn svzerodsolver(text: &str) -> Result<(), String> {
    svzerod::plan("network", text).map(drop)
}

/// Reads a network of openBF and the inflow beside it.
///
/// # Errors
/// With what is wrong in the file.
pub fn openbf(file: &Path, text: &str) -> Result<(), String> {
    openbf::plan(file, text).map(drop)
}
