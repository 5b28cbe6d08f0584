//! What travels between coordinator and workers: whether a run can, and the jobs of a batch as they do.
//!
//! Next file to read: the module `convert` of `starlings-proto`, which holds the limits.

use std::sync::mpsc::Sender;

use starlings_models::{Job, Prediction};
use starlings_proto::convert::job::check_size;
use starlings_proto::convert::state::check_state;
use starlings_proto::{JobEncoder, ProtocolError, SetupId, State};

use crate::hub::{Reply, Submission};
use crate::{FleetError, Held, StateError, StateStore};

/// Whether a job and its prediction can travel.
///
/// # Errors
/// What is too large, as the fleet would say it.
pub fn travels(job: &Job, prediction: &Prediction) -> Result<(), ProtocolError> {
    check_size(job)?;
    check_state(prediction.state.len())
}

/// A batch as it travels; large states are in the store and stay there until it is over.
pub(crate) fn submission(
    jobs: Vec<(SetupId, Job<Held>)>,
    store: &StateStore,
    reply: Sender<Reply>,
) -> Result<Submission, FleetError> {
    for (_, job) in &jobs {
        check_size(job).map_err(FleetError::TooLarge)?;
        check_state(job.state.as_ref().map_or(0, Held::n_state)).map_err(FleetError::TooLarge)?;
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
        let window = Window { start: 0.0, times: vec![1.0], observed: vec![1.0], inputs: Vec::new() };
        let job = Job { particle: 0, record: 0, window: Arc::new(window), theta: Vec::new(), state: None };
        let ended = |n: usize| Prediction { outputs: vec![1.0], state: vec![0.0; n], cost: 0.0 };
        assert_eq!(travels(&job, &ended(32_768)), Ok(()));
        assert_eq!(travels(&job, &ended(32_769)), Ok(()));
        let never = Window { times: Vec::new(), ..(*job.window).clone() };
        let error = travels(&Job { window: Arc::new(never), ..job }, &ended(1));
        assert!(matches!(error, Err(ProtocolError::Shape { .. })), "a window without times");
    }
}
