//! Translates between the generated types and the project's own types, and checks everything that arrives.
//!
//! The only module that looks inside [`crate::generated`] and [`crate::generated_solver`]. Every bit of every number survives both
//! ways; a malformed message is a [`ProtocolError`], never a panic. Next files to read: [`from_worker`], [`to_worker`], [`job`].

pub mod block;
pub mod ended;
pub mod floats;
pub mod from_worker;
pub mod held;
pub mod job;
pub mod key;
pub mod lent;
pub mod piece_names;
pub mod solver;
pub mod state;
pub mod to_worker;
mod window;
pub mod windows;

use starlings_models::Setup;

pub use block::Block;
pub use from_worker::{FromWorker, Hello, LeaseOutcome};
pub use held::HeldRun;
pub use job::JobEncoder;
pub use key::{InKey, JobKey, JobKeys, job_key};
pub use state::{State, StateId, StateNaming};
pub use to_worker::{ToWorker, Welcome};
pub use windows::{ReceivedWindows, SentWindows};

use crate::generated;

/// Name of a setup: BLAKE3 of its JSON text.
pub type SetupId = [u8; 32];

/// The right to answer for one job once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Lease {
    /// Number of the stream on which it was given.
    pub epoch: u64,
    /// Number of the job, unique in the coordinator's life.
    pub job: u64,
    /// 1 for the first attempt.
    pub attempt: u32,
}

/// Why a message is not what the protocol says.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProtocolError {
    /// A field that must be there is not.
    #[error("the message has no `{0}`")]
    Missing(&'static str),
    /// An array of numbers whose bytes are not a multiple of eight.
    #[error("`{field}` has {bytes} bytes, which is no whole number of 64-bit floats")]
    Ragged {
        /// The field.
        field: &'static str,
        /// Its length in bytes.
        bytes: usize,
    },
    /// Arrays whose lengths do not fit together, or a value out of its range.
    #[error("`{field}`: {message}")]
    Shape {
        /// The field.
        field: &'static str,
        /// What is wrong.
        message: String,
    },
    /// A job over a window that was not sent before it.
    #[error("a job names a window that was not sent before it")]
    UnknownWindow,
    /// A state beyond [`crate::MAX_STATE`], or beyond [`crate::MAX_INLINE_STATE`] inside a message.
    #[error("the state has {bytes} bytes; more than {limit} cannot travel")]
    StateTooLarge {
        /// Size of the state in bytes.
        bytes: usize,
        /// The limit in bytes.
        limit: usize,
    },
    /// A job that does not decode although its lease does; the worker answers it as a failure.
    #[error("job {}: {source}", lease.job)]
    Job {
        /// The lease to answer.
        lease: Lease,
        /// What is wrong with the job.
        source: Box<ProtocolError>,
    },
    /// A setup that does not survive its own text, or text that is no setup.
    #[error("the setup does not travel: {0}")]
    Setup(String),
}

/// BLAKE3 of some bytes.
pub fn digest(bytes: &[u8]) -> [u8; 32] {
    *blake3::hash(bytes).as_bytes()
}

/// The JSON text of a setup and its name.
///
/// # Errors
/// [`ProtocolError::Setup`] when the text would not give the same setup back, as with an infinite constant.
pub fn encode_setup(setup: &Setup) -> Result<(SetupId, bytes::Bytes), ProtocolError> {
    let json = serde_json::to_vec(setup).map_err(|e| ProtocolError::Setup(e.to_string()))?;
    let back = serde_json::from_slice::<Setup>(&json).map_err(|e| ProtocolError::Setup(e.to_string()))?;
    if back != *setup {
        return Err(ProtocolError::Setup("its JSON text gives another setup back".to_owned()));
    }
    Ok((digest(&json), json.into()))
}

/// The setup of a JSON text, checked against its name.
///
/// # Errors
/// [`ProtocolError::Setup`] when the text was damaged or is no setup.
pub fn decode_setup(id: &SetupId, json: &[u8]) -> Result<Setup, ProtocolError> {
    if digest(json) != *id {
        return Err(ProtocolError::Setup("its text does not hash to its name".to_owned()));
    }
    serde_json::from_slice(json).map_err(|e| ProtocolError::Setup(e.to_string()))
}

pub(crate) fn setup_id(bytes: &[u8]) -> Result<SetupId, ProtocolError> {
    hash(bytes, "setup id")
}

fn hash(bytes: &[u8], field: &'static str) -> Result<[u8; 32], ProtocolError> {
    let shape =
        |_| ProtocolError::Shape { field, message: format!("has {} bytes, expected 32", bytes.len()) };
    bytes.try_into().map_err(shape)
}

pub(crate) fn required<T>(value: Option<T>, field: &'static str) -> Result<T, ProtocolError> {
    value.ok_or(ProtocolError::Missing(field))
}

impl From<Lease> for generated::Lease {
    fn from(lease: Lease) -> Self {
        Self { epoch: lease.epoch, job: lease.job, attempt: lease.attempt }
    }
}

impl From<generated::Lease> for Lease {
    fn from(lease: generated::Lease) -> Self {
        Self { epoch: lease.epoch, job: lease.job, attempt: lease.attempt }
    }
}
