//! States in memory that coordinator and worker both see, for processes of one machine.
//!
//! The descriptors of that memory do not travel in messages: [`crate::descriptors`]. Next file to read: [`super::state`].

use tonic::Code;

use super::state::PutHead;
use super::{ProtocolError, required};
use crate::generated;

/// What a put of a state in memory that is not lent for it ends with: the state has to come in pieces.
pub const NOT_LENT: Code = Code::NotFound;

/// A worker's request for memory for end states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lend {
    /// As in a put of the end state of a run.
    pub head: PutHead,
    /// The number under which the worker takes the descriptor.
    pub descriptor: u64,
}

impl Lend {
    /// The request.
    pub fn encode(self) -> generated::LendRequest {
        generated::LendRequest { head: self.head.encode().head, descriptor: self.descriptor }
    }

    /// Checks a request.
    ///
    /// # Errors
    /// When the head is none of a put, or there is no number.
    pub fn decode(message: &generated::LendRequest) -> Result<Self, ProtocolError> {
        let head = required(message.head, "head")?;
        let head = PutHead::decode(&generated::Chunk { head: Some(head), ..generated::Chunk::default() })?;
        if message.descriptor == 0 {
            let message = "a request for memory without the number of a descriptor".to_owned();
            return Err(ProtocolError::Shape { field: "descriptor", message });
        }
        Ok(Self { head, descriptor: message.descriptor })
    }
}

/// What a worker says of memory that it cannot use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GiveBack {
    /// Number of its stream.
    pub epoch: u64,
    /// The nonce of its Hello.
    pub nonce: u64,
    /// The number under which the memory was lent.
    pub descriptor: u64,
}

impl GiveBack {
    /// The request.
    pub fn encode(self) -> generated::GiveBackRequest {
        let Self { epoch, nonce, descriptor } = self;
        generated::GiveBackRequest { epoch, nonce, descriptor }
    }

    /// Checks a request.
    ///
    /// # Errors
    /// When there is no number.
    pub fn decode(message: &generated::GiveBackRequest) -> Result<Self, ProtocolError> {
        let generated::GiveBackRequest { epoch, nonce, descriptor } = *message;
        if descriptor == 0 {
            let message = "memory is given back without its number".to_owned();
            return Err(ProtocolError::Shape { field: "descriptor", message });
        }
        Ok(Self { epoch, nonce, descriptor })
    }
}

/// The message that stands for all values of a state, which are in memory of this number that both processes see.
pub fn encode_in_memory(descriptor: u64) -> generated::Chunk {
    generated::Chunk { in_memory: descriptor, ..generated::Chunk::default() }
}

/// The number of the memory that all values of a state are in; `None` for another message.
///
/// # Errors
/// When it does and has something else beside.
pub fn decode_in_memory(message: &generated::Chunk) -> Result<Option<u64>, ProtocolError> {
    if message.in_memory == 0 {
        return Ok(None);
    }
    if message.head.is_some() || !message.data.is_empty() || !message.names.is_empty() {
        let message = "a state in memory with a head, values or names beside it".to_owned();
        return Err(ProtocolError::Shape { field: "in_memory", message });
    }
    Ok(Some(message.in_memory))
}

#[cfg(test)]
mod tests {
    use super::super::Lease;
    use super::super::piece_names::{decode_names, encode_names};
    use super::super::state::{decode_chunk, decode_head, encode_chunk};
    use super::*;

    #[test]
    fn a_request_for_memory_arrives_as_it_left_and_one_without_a_number_is_refused() {
        let head = PutHead { n_state: 7, lease: Lease { epoch: 1, job: 2, attempt: 3 }, nonce: 4 };
        let lend = Lend { head, descriptor: 5 };
        assert_eq!(Lend::decode(&lend.encode()), Ok(lend));
        assert!(Lend::decode(&Lend { descriptor: 0, ..lend }.encode()).is_err());
        assert!(Lend::decode(&generated::LendRequest { head: None, descriptor: 5 }).is_err());
        let back = GiveBack { epoch: 1, nonce: 2, descriptor: 3 };
        assert_eq!(GiveBack::decode(&back.encode()), Ok(back));
        assert!(GiveBack::decode(&GiveBack { descriptor: 0, ..back }.encode()).is_err());
    }

    #[test]
    fn a_state_in_memory_has_nothing_beside_it_and_is_no_piece() {
        assert_eq!(decode_in_memory(&encode_in_memory(7)), Ok(Some(7)));
        assert_eq!(decode_in_memory(&encode_chunk(vec![0; 8].into())), Ok(None));
        let with = |chunk: generated::Chunk| generated::Chunk { in_memory: 7, ..chunk };
        assert!(decode_in_memory(&with(encode_chunk(vec![0; 8].into()))).is_err());
        assert!(decode_in_memory(&with(encode_names(&[[1; 32]]))).is_err());
        assert!(decode_names(&with(encode_names(&[[1; 32]])), 1).is_err());
        assert!(decode_chunk(with(encode_chunk(vec![0; 8].into())), 1).is_err());
        assert!(decode_head(&with(super::super::state::encode_head(7))).is_err());
    }
}
