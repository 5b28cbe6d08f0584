//! What a solver says of itself, as a file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use starlings_models::Description;

fuzz_target!(|bytes: &[u8]| {
    let Ok(description) = serde_json::from_slice::<Description>(bytes) else { return };
    let text = serde_json::to_vec(&description).expect("it can be written");
    serde_json::from_slice::<Description>(&text).expect("what was written can be read");
});
