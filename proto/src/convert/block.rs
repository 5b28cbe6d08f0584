//! A block of rows that a worker mixes, both ways: which pieces of the shared folder it takes, and which it made there.

use bytes::Bytes;

use super::piece_names::{join, split};
use super::state::{CHUNK_VALUES, ChunkId};
use super::{Lease, ProtocolError, floats, required};
use crate::generated;
use crate::text::cut;

/// Piece k of the states of all particles, and the transform that makes the new ones of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Values of each piece, 1 to [`CHUNK_VALUES`].
    pub rows: usize,
    /// Names of the pieces, by particle; at least one.
    pub pieces: Vec<ChunkId>,
    /// As many rows and columns as there are particles, column by column.
    pub transform: Vec<f64>,
}

/// The message with a block to mix; `transform` as [`floats::encode`] makes it.
pub(super) fn encode(
    lease: Lease,
    rows: usize,
    pieces: &[ChunkId],
    transform: Bytes,
) -> generated::Recombine {
    generated::Recombine { lease: Some(lease.into()), rows: rows as u32, pieces: join(pieces), transform }
}

/// A block to mix.
pub(super) fn decode(message: &generated::Recombine) -> Result<(Lease, Block), ProtocolError> {
    let lease = required(message.lease, "lease")?.into();
    let (rows, pieces) = (message.rows as usize, split(&message.pieces, "pieces")?);
    let transform = floats::decode(&message.transform, "transform")?;
    let n = pieces.len();
    if n == 0 || rows == 0 || rows > CHUNK_VALUES || n.checked_mul(n) != Some(transform.len()) {
        let message = format!("{} values for {n} pieces of {rows} values", transform.len());
        return Err(ProtocolError::Shape { field: "transform", message });
    }
    Ok((lease, Block { rows, pieces, transform }))
}

/// The message with what came of a block.
pub(super) fn encode_made(lease: Lease, made: Result<Vec<ChunkId>, String>) -> generated::Recombined {
    let (pieces, failure) = match made {
        Ok(pieces) => (join(&pieces), None),
        Err(failure) => (Bytes::new(), Some(failure)),
    };
    generated::Recombined { lease: Some(lease.into()), pieces, failure }
}

/// What came of a block.
pub(super) fn decode_made(
    message: generated::Recombined,
) -> Result<(Lease, Result<Vec<ChunkId>, String>), ProtocolError> {
    let lease = required(message.lease, "lease")?.into();
    let made = match message.failure {
        Some(failure) => Err(cut(failure)),
        None => Ok(split(&message.pieces, "pieces")?),
    };
    Ok((lease, made))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_comes_back_as_it_went_and_one_that_does_not_fit_is_refused() {
        let lease = Lease { epoch: 1, job: 2, attempt: 3 };
        let pieces = vec![[1; 32], [2; 32]];
        let transform = vec![1.0, -0.0, 0.5, f64::MIN_POSITIVE / 2.0];
        let message = encode(lease, 7, &pieces, floats::encode(&transform));
        let block = Block { rows: 7, pieces: pieces.clone(), transform };
        assert_eq!(decode(&message), Ok((lease, block)));
        let refused = |change: &dyn Fn(&mut generated::Recombine)| {
            let mut other = message.clone();
            change(&mut other);
            assert!(decode(&other).is_err(), "{other:?}");
        };
        refused(&|m| m.lease = None);
        refused(&|m| m.rows = 0);
        refused(&|m| m.rows = CHUNK_VALUES as u32 + 1);
        refused(&|m| m.pieces = Bytes::new());
        refused(&|m| m.pieces = vec![0; 65].into());
        refused(&|m| m.transform = vec![0; 24].into());
        for made in [Ok(pieces), Err("no room".to_owned())] {
            assert_eq!(decode_made(encode_made(lease, made.clone())), Ok((lease, made)));
        }
        assert!(
            decode_made(generated::Recombined { pieces: vec![0; 31].into(), ..Default::default() }).is_err()
        );
    }
}
