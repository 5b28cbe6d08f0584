//! What a coordinator sends, message after message on one stream with its named windows.
#![no_main]

use libfuzzer_sys::fuzz_target;
use prost::Message;
use starlings_proto::{ReceivedWindows, ToWorker, generated};

fuzz_target!(|bytes: &[u8]| {
    let mut windows = ReceivedWindows::default();
    let mut rest = bytes;
    // Messages stand one after the other, each after its length.
    while let Ok(message) = generated::ToWorker::decode_length_delimited(&mut rest) {
        let _ = ToWorker::decode(message, &mut windows);
        if rest.is_empty() {
            break;
        }
    }
});
