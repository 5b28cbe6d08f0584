//! Jobs and what comes of them as they travel: their states are values or names.
//!
//! Next file to read: [`super::grpc`], which makes names of large states and states of names.

use starlings_proto::{LeaseOutcome, State, StateId};

/// A job as it travels.
pub(crate) type Job = starlings_models::Job<State>;

/// A prediction as it travels.
pub(crate) type Prediction = starlings_models::Prediction<State>;

/// How a job of a batch ended, as the dispatcher knows it.
pub(crate) type Outcome = super::Outcome<State>;

/// The name of the state that an answer says its run ended in.
pub(crate) fn named(answer: &LeaseOutcome) -> Option<&StateId> {
    match answer {
        LeaseOutcome::Ran(Ok(Prediction { state: State::Named(id), .. })) => Some(id),
        _ => None,
    }
}
