//! A network of svZeroDSolver.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Err(message) = starlings_draft::import::fuzzing::svzerodsolver(text) {
        assert!(!message.is_empty(), "a refusal says why");
    }
});
