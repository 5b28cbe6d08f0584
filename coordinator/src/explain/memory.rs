//! A run's answer as it is remembered: the key that says everything it depends on, and its bytes.
//!
//! Next file to read: [`super::laboratory`].

use std::sync::Arc;

use crate::fleet::SetupId;
use crate::study::store::RunKey;

/// The outputs of one run, or why there are none.
pub(super) type Known = Result<Arc<Vec<f64>>, String>;

/// Everything that the answer of a run depends on; the recordings are the run folder's to check.
pub(super) fn key(setup: &SetupId, record: usize, theta: &[f64]) -> RunKey {
    let mut hasher = blake3::Hasher::new();
    hasher.update(setup);
    hasher.update(&(record as u64).to_le_bytes());
    for value in theta {
        hasher.update(&value.to_le_bytes());
    }
    *hasher.finalize().as_bytes()
}

/// One byte that says which, then the numbers or the text.
pub(super) fn encode(known: &Known) -> Vec<u8> {
    match known {
        Ok(outputs) => std::iter::once(1).chain(outputs.iter().flat_map(|v| v.to_le_bytes())).collect(),
        Err(reason) => [&[0], reason.as_bytes()].concat(),
    }
}

/// What was remembered.
pub(super) fn decode(body: &[u8]) -> Known {
    let (which, rest) = body.split_first().unwrap_or((&0, &[]));
    if *which == 0 {
        return Err(String::from_utf8_lossy(rest).into_owned());
    }
    let number = |bytes: &[u8]| bytes.try_into().map_or(f64::NAN, f64::from_le_bytes);
    Ok(Arc::new(rest.chunks(8).map(number).collect()))
}
