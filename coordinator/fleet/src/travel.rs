//! Whether a run fits in the messages between coordinator and workers, asked before there are any.
//!
//! Next file to read: the module `convert` of `starlings-proto`, which holds the limits.

use starlings_models::{Job, Prediction};
use starlings_proto::ProtocolError;
use starlings_proto::convert::job::{check_size, check_state};

/// Whether a job and its prediction can travel.
///
/// # Errors
/// What is too large, as the fleet would say it.
pub fn travels(job: &Job, prediction: &Prediction) -> Result<(), ProtocolError> {
    check_size(job)?;
    check_state(prediction.state.len())
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
