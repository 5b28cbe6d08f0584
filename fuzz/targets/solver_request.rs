//! The message that asks a solver for a run.
#![no_main]

use libfuzzer_sys::fuzz_target;
use prost::Message;
use starlings_proto::convert::solver::decode_run;
use starlings_proto::generated_solver;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(message) = generated_solver::RunRequest::decode(bytes) {
        let _ = decode_run(&message);
    }
});
