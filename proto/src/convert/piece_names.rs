//! Names of pieces instead of the pieces, for those who see one folder.
//!
//! Next file to read: [`super::state`].

use bytes::Bytes;

use super::ProtocolError;
use super::state::ChunkId;
use crate::generated;

/// Names of pieces in one message at most.
pub const NAMES: usize = 8192;

/// A message with names of the next pieces of a state, at most [`NAMES`].
pub fn encode_names(names: &[ChunkId]) -> generated::Chunk {
    generated::Chunk { names: join(names), ..generated::Chunk::default() }
}

/// The names of the next pieces of a state that has so many more; `None` for a message with a piece itself.
///
/// # Errors
/// When there are more of them, or something else beside them.
pub fn decode_names(
    message: &generated::Chunk,
    wanted: usize,
) -> Result<Option<Vec<ChunkId>>, ProtocolError> {
    if message.names.is_empty() {
        return Ok(None);
    }
    let names = split(&message.names, "names")?;
    if message.head.is_some()
        || !message.data.is_empty()
        || message.in_memory != 0
        || names.len() > wanted.min(NAMES)
    {
        let message = format!("{} names of pieces where {wanted} are missing", names.len());
        return Err(ProtocolError::Shape { field: "names", message });
    }
    Ok(Some(names))
}

/// Names one after the other.
pub(super) fn join(names: &[ChunkId]) -> Bytes {
    names.as_flattened().to_vec().into()
}

/// The reverse of [`join`].
pub(super) fn split(bytes: &[u8], field: &'static str) -> Result<Vec<ChunkId>, ProtocolError> {
    let (names, rest) = bytes.as_chunks::<32>();
    if rest.is_empty() {
        return Ok(names.to_vec());
    }
    let message = format!("has {} bytes, which is no whole number of names", bytes.len());
    Err(ProtocolError::Shape { field, message })
}

#[cfg(test)]
mod tests {
    use super::super::state::{decode_chunk, encode_chunk};
    use super::*;

    #[test]
    fn names_of_pieces_come_alone_and_not_more_than_are_missing() {
        let names = [[1; 32], [2; 32]];
        let message = encode_names(&names);
        assert_eq!(decode_names(&message, 2), Ok(Some(names.to_vec())));
        assert!(decode_names(&message, 1).is_err());
        assert!(decode_names(&generated::Chunk { data: vec![0; 8].into(), ..message.clone() }, 2).is_err());
        assert!(decode_names(&generated::Chunk { names: vec![0; 33].into(), ..message.clone() }, 2).is_err());
        assert!(decode_names(&encode_names(&vec![[0; 32]; NAMES + 1]), NAMES + 1).is_err());
        assert_eq!(decode_names(&encode_chunk(vec![0; 8].into()), 2), Ok(None));
        assert!(decode_chunk(message, 2).is_err());
    }
}
