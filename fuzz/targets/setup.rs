//! The text of a setup: read, its specification asked for, its travelling form the same again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use starlings_models::Setup;
use starlings_proto::{decode_setup, digest, encode_setup};

fuzz_target!(|bytes: &[u8]| {
    let Ok(setup) = decode_setup(&digest(bytes), bytes) else { return };
    let Setup { parameters, .. } = &setup;
    let n = parameters.len();
    if let Ok((id, json)) = encode_setup(&setup) {
        let again = decode_setup(&id, &json).expect("what was written can be read");
        assert_eq!(again.parameters.len(), n);
    }
});
