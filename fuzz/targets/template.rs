//! A template of a study.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| starlings_solver::fuzzing::template(text));
