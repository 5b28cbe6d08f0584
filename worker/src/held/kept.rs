//! One result that is held: whose it is and how it ended.
//!
//! Next file to read: [`super::large`].

use std::sync::Arc;
use std::time::Instant;

use starlings_models::{Job, ParticleError, Prediction};
use starlings_proto::convert::ended;
use starlings_proto::{Bytes, JobKey, JobKeys, SetupId, State};

use super::large::Large;

/// A run that ended.
pub(super) struct Kept {
    /// When it ended, or was sent last.
    pub(super) at: Instant,
    pub(super) of: Of,
    pub(super) ended: Ended,
    /// The coordinator has not its large state, as far as is known: it may ask for it.
    pub(super) is_owed: bool,
    /// Its large state is being put, which has it in memory.
    pub(super) is_put: bool,
    /// What it counts, bytes in memory.
    pub(super) counted: usize,
}

/// The key of a job, or what it is made of.
pub(crate) enum Of {
    Key(JobKey),
    Job(SetupId, Arc<Job>),
}

impl Of {
    pub(crate) fn key(&self, keys: &mut JobKeys) -> JobKey {
        match self {
            Self::Key(key) => *key,
            Self::Job(setup, job) => keys.of(setup, job),
        }
    }
}

/// How a run ended.
#[derive(Clone)]
pub(crate) enum Ended {
    /// As it travels inside a message.
    Inside(Bytes),
    /// In a large state.
    Large(Arc<Large>),
}

impl Ended {
    /// As it is held for a run whose state is not large.
    pub(crate) fn inside(result: &Result<Prediction<State>, ParticleError>, cost: f64) -> Self {
        Self::Inside(ended::encode(result, cost).into())
    }
}

impl Kept {
    /// One that ends now.
    pub(super) fn new(of: Of, ended: Ended, is_put: bool) -> Self {
        let is_owed = matches!(ended, Ended::Large(_));
        Self { at: Instant::now(), of, ended, is_owed, is_put, counted: 0 }
    }

    /// In memory for its own sake.
    pub(super) fn bytes(&self) -> usize {
        let of_job = match &self.of {
            Of::Key(_) => 0,
            Of::Job(_, job) => 8 * (job.theta.len() + job.state.as_ref().map_or(0, |state| state.len())),
        };
        let of_result = match &self.ended {
            Ended::Inside(bytes) => bytes.len(),
            Ended::Large(_) if self.is_put => 0,
            Ended::Large(large) => large.bytes().0,
        };
        of_result + of_job + size_of::<Self>()
    }

    pub(super) fn large(&self) -> Option<&Arc<Large>> {
        if let Ended::Large(large) = &self.ended { Some(large) } else { None }
    }
}
