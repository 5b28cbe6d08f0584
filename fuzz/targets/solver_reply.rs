//! What a solver answers about a run.
#![no_main]

use libfuzzer_sys::fuzz_target;
use prost::Message;
use starlings_proto::convert::solver::{decode_reply, encode_reply};
use starlings_proto::generated_solver;

fuzz_target!(|bytes: &[u8]| {
    let Ok(message) = generated_solver::RunReply::decode(bytes) else { return };
    let Ok(taken) = decode_reply(message) else { return };
    let again = decode_reply(encode_reply(&taken)).expect("what was taken can be sent");
    assert_eq!(format!("{taken:?}"), format!("{again:?}"));
});
