//! States on the wire: inside a message while they are small, under a name and in pieces of their own above that.
//!
//! A name says what the state holds, value by value, so the side that receives the pieces knows that all of them arrived. Next
//! files to read: `proto/fleet.proto`, for Put and Get; [`super::lent`].

use bytes::Bytes;

use super::{Lease, ProtocolError, floats, hash, required};
use crate::{MAX_INLINE_STATE, MAX_STATE, generated};

/// Bytes of a piece of a state; the last one has what is left.
pub const CHUNK_BYTES: usize = 256 * 1024;

/// Values of a piece of a state.
pub const CHUNK_VALUES: usize = CHUNK_BYTES / 8;

/// Name of a state: BLAKE3 of its number of values and of the names of its pieces.
pub type StateId = [u8; 32];

/// Name of a piece of a state: BLAKE3 of its bytes.
pub type ChunkId = [u8; 32];

/// A state as a job or a prediction carries it.
#[derive(Clone, Debug, PartialEq)]
pub enum State {
    /// Its values.
    Values(Vec<f64>),
    /// The name under which its pieces travel.
    Named(StateId),
}

impl Default for State {
    fn default() -> Self {
        Self::Values(Vec::new())
    }
}

impl From<Vec<f64>> for State {
    fn from(values: Vec<f64>) -> Self {
        Self::Values(values)
    }
}

/// Whether a state of so many values can travel.
///
/// # Errors
/// [`ProtocolError::StateTooLarge`].
pub fn check_state(values: usize) -> Result<(), ProtocolError> {
    at_most(values, MAX_STATE)
}

/// Whether a state of so many values can travel inside a message.
pub(super) fn check_inline(values: usize) -> Result<(), ProtocolError> {
    at_most(values, MAX_INLINE_STATE)
}

fn at_most(values: usize, limit: usize) -> Result<(), ProtocolError> {
    let bytes = values.saturating_mul(8);
    if bytes > limit { Err(ProtocolError::StateTooLarge { bytes, limit }) } else { Ok(()) }
}

/// Makes the name of a state from those of its pieces, in their order.
#[derive(Clone, Debug)]
pub struct StateNaming(blake3::Hasher);

impl StateNaming {
    /// Begins the name of a state of so many values.
    pub fn of(n_state: usize) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(n_state as u64).to_le_bytes());
        Self(hasher)
    }

    /// Takes the name of the next piece.
    pub fn piece(&mut self, name: &ChunkId) {
        self.0.update(name);
    }

    /// The name.
    pub fn finish(&self) -> StateId {
        *self.0.finalize().as_bytes()
    }
}

/// The name of a state of these values.
pub fn name(values: &[f64]) -> StateId {
    let mut naming = StateNaming::of(values.len());
    for piece in values.chunks(CHUNK_VALUES) {
        naming.piece(&super::digest(&floats::encode(piece)));
    }
    naming.finish()
}

/// Number of pieces of a state of so many values.
pub fn n_chunks(n_state: usize) -> usize {
    n_state.div_ceil(CHUNK_VALUES)
}

/// Values of a piece of a state of so many values; zero beyond its last one.
pub fn chunk_values(n_state: usize, index: usize) -> usize {
    n_state.saturating_sub(index.saturating_mul(CHUNK_VALUES)).min(CHUNK_VALUES)
}

/// What the first message of a put says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PutHead {
    /// Values of the state; not more than may travel.
    pub n_state: usize,
    /// The run that it belongs to.
    pub lease: Lease,
    /// The nonce of the worker.
    pub nonce: u64,
}

/// A worker's request for a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Get {
    /// Number of the worker's stream.
    pub epoch: u64,
    /// The nonce of the worker.
    pub nonce: u64,
    /// Name of the state.
    pub state: StateId,
    /// The names of its pieces are enough.
    pub names: bool,
    /// The number under which a descriptor of its memory is taken; 0 where none is.
    pub descriptor: u64,
}

impl PutHead {
    /// The first message of a put, without values.
    pub fn encode(self) -> generated::Chunk {
        let Self { n_state, lease, nonce } = self;
        let head = generated::StateHead { n_state: n_state as u64, lease: Some(lease.into()), nonce };
        generated::Chunk { head: Some(head), ..generated::Chunk::default() }
    }

    /// Checks the first message of a put, which has no values.
    ///
    /// # Errors
    /// What is missing or does not fit.
    pub fn decode(message: &generated::Chunk) -> Result<Self, ProtocolError> {
        let n_state = decode_head(message)?;
        let head = required(message.head.as_ref(), "head")?;
        Ok(Self { n_state, lease: required(head.lease, "lease")?.into(), nonce: head.nonce })
    }
}

impl Get {
    /// The request.
    pub fn encode(self) -> generated::GetRequest {
        let Self { epoch, nonce, state, names, descriptor } = self;
        generated::GetRequest { epoch, nonce, state_id: Bytes::copy_from_slice(&state), names, descriptor }
    }

    /// Checks a request.
    ///
    /// # Errors
    /// When the name is none.
    pub fn decode(message: &generated::GetRequest) -> Result<Self, ProtocolError> {
        let state = hash(&message.state_id, "state id")?;
        let generated::GetRequest { epoch, nonce, names, descriptor, .. } = *message;
        Ok(Self { epoch, nonce, state, names, descriptor })
    }
}

/// The first message of an answer to a get, without values.
pub fn encode_head(n_state: usize) -> generated::Chunk {
    let head = generated::StateHead { n_state: n_state as u64, lease: None, nonce: 0 };
    generated::Chunk { head: Some(head), ..generated::Chunk::default() }
}

/// The number of values of the state of which this is the first message.
///
/// # Errors
/// When it is no first message, has values, or the state is larger than may travel.
pub fn decode_head(message: &generated::Chunk) -> Result<usize, ProtocolError> {
    let n_state = required(message.head.as_ref(), "head")?.n_state as usize;
    check_state(n_state)?;
    if !message.data.is_empty() || !message.names.is_empty() || message.in_memory != 0 {
        let message = "the first message of a state has values".to_owned();
        return Err(ProtocolError::Shape { field: "data", message });
    }
    Ok(n_state)
}

/// A message with a piece of a state.
pub fn encode_chunk(data: Bytes) -> generated::Chunk {
    generated::Chunk { data, ..generated::Chunk::default() }
}

/// The bytes of a piece that must have so many values.
///
/// # Errors
/// When it has another length, or a head.
pub fn decode_chunk(message: generated::Chunk, values: usize) -> Result<Bytes, ProtocolError> {
    if message.head.is_some() || !message.names.is_empty() || message.in_memory != 0 {
        let message = "a second head, names or memory among the pieces of a state".to_owned();
        return Err(ProtocolError::Shape { field: "head", message });
    }
    let wanted = values * 8;
    if message.data.len() != wanted || wanted == 0 {
        let message = format!("a piece of {} bytes where {wanted} belong", message.data.len());
        return Err(ProtocolError::Shape { field: "data", message });
    }
    Ok(message.data)
}

/// The answer to a put.
pub fn encode_put_result(state: &StateId) -> generated::PutResult {
    generated::PutResult { state_id: Bytes::copy_from_slice(state) }
}

/// The name that the answer to a put says.
///
/// # Errors
/// When it is none.
pub fn decode_put_result(message: &generated::PutResult) -> Result<StateId, ProtocolError> {
    hash(&message.state_id, "state id")
}

/// The fields for a state: its values, or its name.
pub(super) fn encode(state: Option<&State>) -> (Option<Bytes>, Option<Bytes>) {
    match state {
        None => (None, None),
        Some(State::Values(values)) => (Some(floats::encode(values)), None),
        Some(State::Named(id)) => (None, Some(Bytes::copy_from_slice(id))),
    }
}

/// The state of these fields.
pub(super) fn decode(inside: Option<&[u8]>, named: Option<&[u8]>) -> Result<Option<State>, ProtocolError> {
    if let Some(name) = named {
        if inside.is_some_and(|bytes| !bytes.is_empty()) {
            let message = "a message has a state and the name of one".to_owned();
            return Err(ProtocolError::Shape { field: "state", message });
        }
        return Ok(Some(State::Named(hash(name, "state id")?)));
    }
    let Some(bytes) = inside else { return Ok(None) };
    check_inline(bytes.len() / 8)?;
    Ok(Some(State::Values(floats::decode(bytes, "state")?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_changes_with_the_length_the_pieces_and_their_order() {
        let (a, b) = ([1; 32], [2; 32]);
        let name = |n: usize, pieces: &[ChunkId]| {
            let mut naming = StateNaming::of(n);
            for piece in pieces {
                naming.piece(piece);
            }
            naming.finish()
        };
        let of = name(40_000, &[a, b]);
        assert_eq!(of, name(40_000, &[a, b]));
        assert_ne!(of, name(40_001, &[a, b]));
        assert_ne!(of, name(40_000, &[b, a]));
        assert_ne!(of, name(40_000, &[a]));
    }

    #[test]
    fn pieces_of_a_wrong_length_and_second_heads_are_refused() {
        let chunk = |n: usize| encode_chunk(vec![0; n].into());
        assert_eq!(decode_chunk(chunk(16), 2).map(|data| data.len()), Ok(16));
        assert!(decode_chunk(chunk(16), 3).is_err());
        assert!(decode_chunk(chunk(0), 0).is_err(), "a piece after the last one");
        assert!(decode_chunk(encode_head(2), 2).is_err());
        assert!(decode_head(&chunk(16)).is_err());
        assert!(decode_head(&encode_head(crate::MAX_STATE / 8 + 1)).is_err());
        assert!(decode_head(&encode_head(usize::MAX)).is_err());
        let head = PutHead { n_state: 7, lease: Lease { epoch: 1, job: 2, attempt: 3 }, nonce: 4 };
        assert_eq!(PutHead::decode(&head.encode()), Ok(head));
        assert!(PutHead::decode(&encode_head(7)).is_err(), "a put without a lease");
        assert_eq!(
            [n_chunks(0), n_chunks(1), n_chunks(CHUNK_VALUES), n_chunks(CHUNK_VALUES + 1)],
            [0, 1, 1, 2]
        );
        assert_eq!([0, 1, 2].map(|k| chunk_values(CHUNK_VALUES + 1, k)), [CHUNK_VALUES, 1, 0]);
    }

    #[test]
    fn a_state_with_values_and_a_name_is_refused() {
        assert!(decode(Some(&[0; 8]), Some(&[0; 32])).is_err());
        assert!(decode(None, Some(&[0; 31])).is_err());
        assert_eq!(decode(Some(&[]), Some(&[3; 32])), Ok(Some(State::Named([3; 32]))));
        assert_eq!(decode(Some(&[]), None), Ok(Some(State::default())));
    }
}
