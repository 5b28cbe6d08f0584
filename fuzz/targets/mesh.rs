//! A mesh in the Object File Format.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| starlings_study::fuzzing::mesh(text));
