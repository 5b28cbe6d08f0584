//! What a solver says of itself, as a message.
#![no_main]

use libfuzzer_sys::fuzz_target;
use prost::Message;
use starlings_proto::convert::solver::description::{decode_description, encode_description};
use starlings_proto::generated_solver;

fuzz_target!(|bytes: &[u8]| {
    let Ok(message) = generated_solver::Description::decode(bytes) else { return };
    let Ok(taken) = decode_description(&message) else { return };
    let again = decode_description(&encode_description(&taken)).expect("what was taken can be sent");
    assert_eq!(format!("{taken:?}"), format!("{again:?}"));
});
