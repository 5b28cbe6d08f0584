//! What a UM-Bridge server answers about a run.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| starlings_solver::fuzzing::um_bridge_answer(bytes));
