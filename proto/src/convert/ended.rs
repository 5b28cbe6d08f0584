//! How a run ended, as bytes that can be kept: in the database of a run, or by a worker until it can deliver.
//!
//! The bytes are those of the message `Result`, without a lease. Next file to read: [`super::from_worker`].

use prost::Message;
use starlings_models::{ParticleError, Prediction};

use super::from_worker::{decode_ended, encode_ended};
use super::{ProtocolError, State};
use crate::generated;

/// The bytes of how a run ended and what it cost, seconds of wall time. A large state is there by its name alone.
pub fn encode(ended: &Result<Prediction<State>, ParticleError>, cost: f64) -> Vec<u8> {
    let outcome = Some(encode_ended(ended));
    generated::Result { lease: None, outcome, cost_s: cost }.encode_to_vec()
}

/// How a run ended, and what it cost.
///
/// # Errors
/// When the bytes are no such message.
pub fn decode(bytes: &[u8]) -> Result<(Result<Prediction<State>, ParticleError>, f64), ProtocolError> {
    let damaged =
        |error: prost::DecodeError| ProtocolError::Shape { field: "result", message: error.to_string() };
    decode_ended(generated::Result::decode(bytes).map_err(damaged)?)
}

#[cfg(test)]
mod tests {
    use starlings_models::{ModelFailure, Timeout};

    use super::*;

    #[test]
    fn a_run_that_is_kept_comes_back_bit_by_bit() {
        let state = vec![f64::MIN_POSITIVE; crate::MAX_INLINE_STATE / 8];
        let prediction = Prediction { outputs: vec![1.0, -0.0], state: state.into(), cost: 0.25 };
        let named = Prediction { state: State::Named([7; 32]), ..prediction.clone() };
        let late = Timeout { limit: 2.0, says: "too late".to_owned() };
        let failed = ModelFailure::StepTooSmall { time: 0.0, step: 1e-300 };
        for ended in [Ok(prediction), Ok(named), Err(late.into()), Err(failed.into())] {
            let (back, cost) = decode(&encode(&ended, 0.25)).unwrap();
            assert_eq!((back, cost), (ended, 0.25));
        }
    }

    #[test]
    fn damaged_bytes_are_an_error() {
        assert!(decode(&[1, 2, 3]).is_err());
        assert!(decode(&[]).is_err(), "no outcome");
    }
}
