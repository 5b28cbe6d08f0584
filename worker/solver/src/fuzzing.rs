//! Entrances of the fuzzer, there only for it: readers that are otherwise reached through a solver's program.

use crate::adapter::command::fuzzing;

/// Reads outputs by a rule out of what a program wrote to its standard output.
pub fn results(rule: &str, written: &str) {
    fuzzing::results(rule, written);
}

/// Reads a template of an input file.
pub fn template(text: &str) {
    fuzzing::template(text);
}
