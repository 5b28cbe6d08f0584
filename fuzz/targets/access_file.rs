//! An access file: what is taken is written again as it was.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use starlings_proto::access::AccessFile;

fuzz_target!(|text: &str| {
    let path = Path::new("access.json");
    let Ok(access) = AccessFile::from_text(path, text) else { return };
    let written = serde_json::to_string(&access).expect("it can be written");
    let again = AccessFile::from_text(path, &written).expect("what was written can be read");
    assert!(again.token.is(access.token.digits().as_bytes()));
    assert_eq!(again.addresses, access.addresses);
});
