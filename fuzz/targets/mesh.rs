//! A mesh in OFF, STL and VTP.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| starlings_study::fuzzing::mesh(bytes));
