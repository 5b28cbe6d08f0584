//! What a program wrote, read by the rules of a study: the first line is the rule, the rest the file.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let (rule, written) = text.split_once('\n').unwrap_or((text, ""));
    starlings_solver::fuzzing::results(rule, written);
});
