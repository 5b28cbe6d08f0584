//! How a run ended, as the database of a run and a worker's memory keep it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use starlings_proto::convert::ended::{decode, encode};

fuzz_target!(|bytes: &[u8]| {
    let Ok((ended, cost)) = decode(bytes) else { return };
    let again = decode(&encode(&ended, cost)).expect("what was taken can be kept");
    // NaN is equal to nothing, so the texts are compared.
    assert_eq!(format!("{:?}", (ended, cost)), format!("{again:?}"));
});
