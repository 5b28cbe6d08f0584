//! Whether a run fits in the messages between coordinator and workers, asked before there are any.
//!
//! Next file to read: the module `convert` of `starlings-proto`, which holds the limits.

use starlings_models::{Job, Prediction};
use starlings_proto::convert::job::check_size;
use starlings_proto::{MAX_INLINE_STATE, ProtocolError};

/// Whether a job and its prediction can travel.
///
/// # Errors
/// What is too large, as the fleet would say it.
pub fn travels(job: &Job, prediction: &Prediction) -> Result<(), ProtocolError> {
    check_size(job)?;
    let bytes = prediction.state.len() * 8;
    if bytes > MAX_INLINE_STATE {
        return Err(ProtocolError::StateTooLarge { bytes, limit: MAX_INLINE_STATE });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use starlings_models::Window;

    use super::*;

    #[test]
    fn a_state_of_32_768_numbers_travels_and_one_more_does_not() {
        let window = Window { start: 0.0, times: vec![1.0], observed: vec![1.0], inputs: Vec::new() };
        let job = Job { particle: 0, record: 0, window: Arc::new(window), theta: Vec::new(), state: None };
        let ended = |n: usize| Prediction { outputs: vec![1.0], state: vec![0.0; n], cost: 0.0 };
        assert_eq!(travels(&job, &ended(32_768)), Ok(()));
        let error = travels(&job, &ended(32_769)).map_err(|e| e.to_string());
        assert!(error.is_err_and(|text| text.starts_with("the state has 262152 bytes; more than 262144")));
    }
}
