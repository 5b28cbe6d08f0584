//! What travels between coordinator and workers: whether a run can, and the jobs of a batch as they do.
//!
//! Next file to read: the module `convert` of `starlings-proto`, which holds the limits.

use starlings_models::{Job, Prediction};
use starlings_proto::convert::job::check_size;
use starlings_proto::convert::state::check_state;
use starlings_proto::{JobEncoder, ProtocolError, SetupId, State};
use tokio::sync::oneshot;

use crate::hub::{Reply, Submission};
use crate::{FleetError, Held, StateError, StateStore};

/// Whether a job can travel.
///
/// # Errors
/// What is too large, as the fleet would say it.
pub fn travels(job: &Job<Held>) -> Result<(), ProtocolError> {
    check_size(job)?;
    check_state(job.state.as_ref().map_or(0, Held::n_state))
}

/// Whether a prediction can travel back.
///
/// # Errors
/// As [`travels`].
pub fn returns(prediction: &Prediction<Held>) -> Result<(), ProtocolError> {
    check_state(prediction.state.n_state())
}

/// A batch as it travels; large states are in the store and stay there until it is over.
pub(crate) fn submission(
    jobs: Vec<(SetupId, Job<Held>)>,
    store: &StateStore,
    reply: oneshot::Sender<Reply>,
) -> Result<Submission, FleetError> {
    for (_, job) in &jobs {
        travels(job).map_err(FleetError::TooLarge)?;
    }
    let mut states = Vec::new();
    let mut travelling = |held: Held| {
        Ok::<_, StateError>(match held.into_travelling(store)? {
            Held::Values(values) => State::Values(values),
            Held::Stored(state) => {
                let id = state.id();
                states.push(state);
                State::Named(id)
            }
        })
    };
    let jobs = jobs.into_iter().map(|(setup, job)| Ok((setup, job.try_map(&mut travelling)?)));
    let jobs = jobs.collect::<Result<Vec<_>, StateError>>()?;
    let encoder = JobEncoder::of(jobs.iter().map(|(_, job)| job));
    Ok(Submission { jobs, states, encoder, reply })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use starlings_models::Window;

    use super::*;

    #[test]
    fn a_state_of_any_size_travels() {
        let window =
            Window { start: 0.0, times: vec![1.0], observed: vec![1.0], inputs: Vec::new(), since: vec![] };
        let window = Arc::new(window);
        for n in [32_768, 32_769] {
            let state = Held::Values(vec![0.0; n]);
            let ended = Prediction { outputs: vec![1.0], state: state.clone(), cost: 0.0 };
            assert_eq!(returns(&ended), Ok(()));
            let window = Arc::clone(&window);
            let job = Job { particle: 0, record: 0, window, theta: Vec::new(), state: Some(state) };
            assert_eq!(travels(&job), Ok(()));
        }
        let never = Arc::new(Window { times: Vec::new(), ..(*window).clone() });
        let error = travels(&Job { particle: 0, record: 0, window: never, theta: Vec::new(), state: None });
        assert!(matches!(error, Err(ProtocolError::Shape { .. })), "a window without times");
    }
}
