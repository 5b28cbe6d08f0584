//! Messages to bytes and back as gRPC does it, with room for the whole message taken at once and no piece of a state in a larger one.
//!
//! A window of a long recording is more than a megabyte: a buffer that grows while it is written ends twice as large, and as many
//! of them wait as there are jobs ahead of a worker. A piece that is kept keeps the whole message that it came in. Next file to read:
//! [`crate::convert`].

use std::any::TypeId;
use std::marker::PhantomData;

use prost::Message;
use prost::bytes::{Buf, BufMut};
use tonic::Status;
use tonic::codec::{DecodeBuf, Decoder, EncodeBuf, Encoder};
use tonic_prost::{ProstCodec, ProstDecoder};

use crate::convert::state::CHUNK_BYTES;
use crate::generated::Chunk;

/// Bytes of a message with a piece of a state, or names of pieces, at most.
const MOST_OF_PIECE: usize = CHUNK_BYTES + 1024;

/// Bytes of a message that is written at once: one of many short fields. Into a buffer of the network every byte of a varint is copied
/// with a look for room, which costs more than to copy the whole once more.
const SMALL: usize = 4096;

/// Encodes `T`, decodes `U`.
#[derive(Debug)]
pub(crate) struct Codec<T, U>(PhantomData<(T, U)>);

impl<T, U> Default for Codec<T, U> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<T: Message + Send + 'static, U: Message + Default + Send + 'static> tonic::codec::Codec for Codec<T, U> {
    type Encode = T;
    type Decode = U;
    type Encoder = Whole<T>;
    type Decoder = Fitting<U>;

    fn encoder(&mut self) -> Self::Encoder {
        Whole { small: Vec::new(), of: PhantomData }
    }

    fn decoder(&mut self) -> Self::Decoder {
        Fitting(ProstCodec::<T, U>::default().decoder())
    }
}

/// Encodes a message: a large one into a buffer of its size, a small one first into memory of its own.
#[derive(Debug)]
pub(crate) struct Whole<T> {
    /// What small messages are written to first.
    small: Vec<u8>,
    of: PhantomData<T>,
}

impl<T: Message> Encoder for Whole<T> {
    type Item = T;
    type Error = Status;

    fn encode(&mut self, item: T, buffer: &mut EncodeBuf<'_>) -> Result<(), Status> {
        let length = item.encoded_len();
        if length > SMALL {
            buffer.reserve(length);
            return item.encode(buffer).map_err(|error| Status::internal(error.to_string()));
        }
        self.small.clear();
        item.encode(&mut self.small).map_err(|error| Status::internal(error.to_string()))?;
        buffer.put_slice(&self.small);
        Ok(())
    }
}

/// Decodes messages; one with a piece of a state has nothing else in it.
#[derive(Debug)]
pub(crate) struct Fitting<U>(ProstDecoder<U>);

impl<U: Message + Default + 'static> Decoder for Fitting<U> {
    type Item = U;
    type Error = Status;

    fn decode(&mut self, source: &mut DecodeBuf<'_>) -> Result<Option<U>, Status> {
        if TypeId::of::<U>() == TypeId::of::<Chunk>() && source.remaining() > MOST_OF_PIECE {
            return Err(Status::invalid_argument(format!(
                "a message of {} bytes for a piece of a state, at most {MOST_OF_PIECE} belong",
                source.remaining()
            )));
        }
        self.0.decode(source)
    }
}
