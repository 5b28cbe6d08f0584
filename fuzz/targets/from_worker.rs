//! What a worker sends: no bytes panic, and a message that is taken survives the way back.
#![no_main]

use libfuzzer_sys::fuzz_target;
use prost::Message;
use starlings_proto::{FromWorker, generated};

fuzz_target!(|bytes: &[u8]| {
    let Ok(message) = generated::FromWorker::decode(bytes) else { return };
    let Ok(taken) = FromWorker::decode(message) else { return };
    let again = taken.clone().encode().expect("what was taken can be sent");
    let again = FromWorker::decode(again).expect("what was sent can be taken");
    // NaN is equal to nothing, so the texts are compared.
    assert_eq!(format!("{taken:?}"), format!("{again:?}"));
});
