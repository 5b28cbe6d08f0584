//! The text of a setup: read, its travelling form the same again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use starlings_proto::{decode_setup, digest, encode_setup};

fuzz_target!(|bytes: &[u8]| {
    let Ok(setup) = decode_setup(&digest(bytes), bytes) else { return };
    if let Ok((id, json)) = encode_setup(&setup) {
        assert_eq!(decode_setup(&id, &json).expect("what was written can be read"), setup);
    }
});
