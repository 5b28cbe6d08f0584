//! What a worker holds when it comes back, and what it is told to go on with, both ways.
//!
//! How a run ended travels as the bytes of [`super::ended`], which a worker keeps as they are. Next file to read: [`super::key`].

use bytes::Bytes;

use super::key::JobKey;
use super::{Lease, ProtocolError, required};
use crate::generated;

/// A run that a worker has finished or still makes, by the key of its job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeldRun {
    /// Its job.
    pub key: JobKey,
    /// How it ended, as [`super::ended::encode`] writes it; `None` while it is being made or waits.
    pub ended: Option<Bytes>,
}

pub(super) fn encode_held(runs: Vec<HeldRun>) -> generated::Held {
    let one =
        |HeldRun { key, ended }| generated::HeldRun { key: Bytes::copy_from_slice(&key), result: ended };
    generated::Held { runs: runs.into_iter().map(one).collect() }
}

pub(super) fn decode_held(held: generated::Held) -> Result<Vec<HeldRun>, ProtocolError> {
    let one = |run: generated::HeldRun| Ok(HeldRun { key: key(&run.key)?, ended: run.result });
    held.runs.into_iter().map(one).collect()
}

pub(super) fn encode_adopted(runs: &[(JobKey, Lease)], rest_is_void: bool) -> generated::Adopt {
    let one = |(key, lease): &(JobKey, Lease)| generated::Adopted {
        key: Bytes::copy_from_slice(key),
        lease: Some((*lease).into()),
    };
    generated::Adopt { runs: runs.iter().map(one).collect(), rest_is_void }
}

pub(super) fn decode_adopted(adopt: generated::Adopt) -> Result<Vec<(JobKey, Lease)>, ProtocolError> {
    let one = |run: generated::Adopted| Ok((key(&run.key)?, required(run.lease, "lease")?.into()));
    adopt.runs.into_iter().map(one).collect()
}

fn key(bytes: &[u8]) -> Result<JobKey, ProtocolError> {
    let message = || format!("has {} bytes, expected 32", bytes.len());
    bytes.try_into().map_err(|_| ProtocolError::Shape { field: "key", message: message() })
}
